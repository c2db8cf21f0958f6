"""The stand-in's folder: its program, ten models, two textures and its shaders."""

import math
import shutil
from pathlib import Path

import numpy as np
from panda3d import core
from PIL import Image

SURFACES = """//Cg
void vshader(float4 vtx_position : POSITION, float3 vtx_normal : NORMAL,
             float2 vtx_texcoord0 : TEXCOORD0, float4 vtx_color : COLOR,
             uniform float4x4 mat_modelproj, uniform float4x4 itp_modelview,
             out float4 l_place : POSITION, out float2 l_uv : TEXCOORD0,
             out float3 l_up : TEXCOORD1, out float4 l_tint : COLOR)
{
    l_tint = vtx_color;
    l_uv = vtx_texcoord0;
    l_up = mul((float3x3)itp_modelview, vtx_normal);
    l_place = mul(mat_modelproj, vtx_position);
}

void fshader(float2 l_uv : TEXCOORD0, float3 l_up : TEXCOORD1, float4 l_tint : COLOR,
             uniform sampler2D tex_0, out float4 o_base : COLOR0, out float4 o_stored : COLOR1)
{
    o_base = tex2D(tex_0, l_uv) * l_tint;
    o_stored = float4(0.5 * (1 + normalize(l_up)), o_base.a);
}
"""
SHINE = """//Cg
void vshader(float4 vtx_position : POSITION, uniform float4x4 mat_modelproj,
             out float4 l_place : POSITION, out float4 l_clip : TEXCOORD0)
{
    l_clip = l_place = mul(mat_modelproj, vtx_position);
}

void fshader(float4 l_clip : TEXCOORD0, uniform sampler2D k_base, uniform sampler2D k_stored,
             uniform sampler2D k_depth, uniform float4 k_lens, uniform float4 k_lightcolor,
             uniform float4 texpad_base, uniform float4 vspos_model, uniform float4 row0_model_to_view,
             out float4 o_share : COLOR)
{
    float2 ndc = l_clip.xy / l_clip.w;
    float2 uv = texpad_base.xy * (1 + ndc);
    float ahead = k_lens.w / (2 * tex2D(k_depth, uv).r - 1 - k_lens.y);
    float3 to_light = vspos_model.xyz - ahead * float3(ndc.x / k_lens.x, 1, ndc.y / k_lens.z);
    float away = length(to_light);
    float left = saturate(1 - away / row0_model_to_view.x);
    float facing = dot(to_light, tex2D(k_stored, uv).xyz) / away;
    o_share = float4(left * left * facing * k_lightcolor.rgb * tex2D(k_base, uv).rgb, 1);
}
"""


def write_art(folder: Path) -> Path:
    """Fill a folder with all that the stand-in needs; return it."""
    folder.mkdir()
    shutil.copy(Path(__file__).with_name("main.py"), folder)
    for name, text in (("surfaces.sha", SURFACES), ("shine.sha", SHINE)):
        (folder / name).write_text(text)
    Image.new("RGB", (4, 4), (255, 255, 255)).save(folder / "white.png")
    across = np.linspace(-1, 1, 32) ** 2
    alpha = np.clip(1 - across[:, None] - across, 0, None) ** 2
    Image.fromarray(np.dstack([np.full((32, 32, 3), 255), 255 * alpha]).astype(np.uint8)).save(
        folder / "spark.png"
    )
    leaves = np.random.default_rng(1).integers(60, 255, (16, 16, 4), dtype=np.uint8)
    leaves[..., 3] = np.where(leaves[..., 3] > 120, 255, 0)
    Image.fromarray(leaves.repeat(8, 0).repeat(8, 1)).save(folder / "leaves.png")
    for number in range(10):
        model = core.NodePath(core.ModelRoot(f"model{number}"))
        {0: _ground, 1: _leaves}.get(number, _trunk)(model, number, folder)
        assert model.write_bam_file(core.Filename.from_os_specific(str(folder / f"model{number}.bam")))
    return folder


def _ground(model, _, __):
    """A hilly ground with colours of its vertices."""
    rows = [
        [(x, y, 4 * math.sin(x / 17) * math.cos(y / 23)) for x in range(-140, 141, 10)]
        for y in range(-120, 281, 10)
    ]
    model.attach_new_node(grid("ground", rows, (0.9, 0.85, 0.7, 1)))


def _leaves(model, _, folder):
    """A card with holes."""
    maker = core.CardMaker("leaves")
    maker.set_frame(-40, 40, 0, 50)
    maker.set_has_normals(True)
    maker.set_color(1, 1, 1, 1)
    card = model.attach_new_node(maker.generate())
    card.set_pos(10, 30, 0)
    texture = core.TexturePool.load_texture(core.Filename.from_os_specific(str(folder / "leaves.png")))
    card.set_texture(texture)


def _trunk(model, number, _):
    """A column."""
    around = [math.radians(-30 * step) for step in range(13)]
    rows = [[(4 * math.cos(a), 4 * math.sin(a), height) for a in around] for height in range(0, 61, 10)]
    path = model.attach_new_node(grid(f"trunk{number}", rows, (1.0, 0.9, 0.8, 1)))
    path.set_pos(-80 + 25 * (number - 2), 20 + 37 * (number * 5 % 8), -3)


def grid(name, rows, color):
    """Quads between rows of points, with smooth normals and one colour at all vertices."""
    points = np.array(rows, dtype=float)
    along, across = np.gradient(points, axis=1), np.gradient(points, axis=0)
    normals = np.cross(along, across)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    data = core.GeomVertexData(name, core.GeomVertexFormat.get_v3n3c4t2(), core.Geom.UH_static)
    writers = [core.GeomVertexWriter(data, column) for column in ("vertex", "normal", "color", "texcoord")]
    height, width = points.shape[:2]
    for row in range(height):
        for column in range(width):
            writers[0].add_data3(*points[row, column])
            writers[1].add_data3(*normals[row, column])
            writers[2].add_data4(*color)
            writers[3].add_data2(column / width, row / height)
    faces = core.GeomTriangles(core.Geom.UH_static)
    for row in range(height - 1):
        for column in range(width - 1):
            a = row * width + column
            faces.add_vertices(a, a + 1, a + width)
            faces.add_vertices(a + width, a + 1, a + width + 1)
    geom = core.Geom(data)
    geom.add_primitive(faces)
    node = core.GeomNode(name)
    node.add_geom(geom)
    return node
