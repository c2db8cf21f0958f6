"""Draw a scene by Panda3D's own renderer in the way of its sample "fireflies", faults included.

``python panda_original.py scene.npz frame.npz`` runs as a process of its own, since Panda3D's
context and ours do not share a thread. What the sample computes is written anew here, in GLSL; Panda3D itself
gives the axes of normals and of light vectors, the targets of 8 bits and the blending.

- Base colours are what is stored, texture times vertex colour; cut out where alpha is below 1/2.
- Normals are Panda3D's for shaders, in OpenGL's axes: x right, y up, z to the viewer. They are written as
  n/2 + 1/2, and read again as they are.
- Light vectors are in Panda3D's own view axes: x right, y forward, z up.
- Each light is added by itself, with (1 - d/R)^2, into 8 bits. Its volume is not tested against the depth.
"""

from __future__ import annotations

import sys

import numpy as np
from panda3d import core as panda

SURFACE = (
    """#version 330
uniform mat4 p3d_ModelViewProjectionMatrix;
uniform mat3 p3d_NormalMatrix;
in vec4 p3d_Vertex;
in vec3 p3d_Normal;
in vec4 p3d_Color;
in vec2 p3d_MultiTexCoord0;
out vec3 normal;
out vec4 color;
out vec2 texcoord;
void main()
{
    normal = p3d_NormalMatrix * p3d_Normal;
    color = p3d_Color;
    texcoord = p3d_MultiTexCoord0;
    gl_Position = p3d_ModelViewProjectionMatrix * p3d_Vertex;
}""",
    """#version 330
uniform sampler2D p3d_Texture0;
in vec3 normal;
in vec4 color;
in vec2 texcoord;
layout(location = 0) out vec4 base;
layout(location = 1) out vec4 stored;
void main()
{
    base = color * texture(p3d_Texture0, texcoord);
    stored = vec4(0.5 + 0.5 * normalize(normal), base.a);
}""",
)
LIGHT = (
    """#version 330
uniform mat4 p3d_ModelViewProjectionMatrix;
in vec4 p3d_Vertex;
void main()
{
    gl_Position = p3d_ModelViewProjectionMatrix * p3d_Vertex;
}""",
    """#version 330
uniform sampler2D base;
uniform sampler2D stored;
uniform sampler2D depth;
uniform vec4 lens;       // A, B, C, D of the projection
uniform vec4 light;      // place in Panda3D's view axes, radius
uniform vec4 tint;
out vec4 share;
void main()
{
    ivec2 texel = ivec2(gl_FragCoord.xy);
    vec2 ndc = 2.0 * gl_FragCoord.xy / vec2(textureSize(depth, 0)) - 1.0;
    float y = lens.w / (2.0 * texelFetch(depth, texel, 0).r - 1.0 - lens.y);
    vec3 to_light = light.xyz - vec3(ndc.x / lens.x * y, y, ndc.y / lens.z * y);
    float d = length(to_light);
    float left = max(1.0 - d / light.w, 0.0);
    float bright = left * left * dot(to_light / d, texelFetch(stored, texel, 0).xyz);
    share = vec4(bright * tint.rgb * texelFetch(base, texel, 0).rgb, 1.0);
}""",
)


def main(given: str, made: str) -> None:
    """Draw what the file `given` describes, and save "color", "albedo" and "normal" as 8-bit codes."""
    panda.load_prc_file_data("", "load-display p3headlessgl\ntextures-power-2 none")
    scene = np.load(given)
    original = Original(tuple(scene["size"].tolist()))
    original.look(scene["camera"], *scene["lens"].tolist())
    for part in range(int(scene["parts"])):
        original.add_part(*(scene[f"{name}_{part}"] for name in PART))
    for position, color in zip(scene["lights"], scene["colors"], strict=True):
        original.add_light(position, color, float(scene["radius"]))
    np.savez(made, **original.draw())


PART = ("vertices", "triangles", "matrix", "texture", "two_sided")
"""Of a part: rows of position, normal, texture coordinates and colour; 8-bit texels, the lowest row first."""


class Original:
    """Two buffers with a camera each: of surfaces, and of the lights that are added up."""

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self._engine = panda.GraphicsEngine.get_global_ptr()
        pipe = panda.GraphicsPipeSelection.get_global_ptr().make_default_pipe()
        self._textures = {name: panda.Texture(name) for name in ("base", "stored", "depth", "color")}
        self._textures["depth"].set_format(panda.Texture.F_depth_component24)
        plain = panda.FrameBufferProperties()
        plain.set_rgba_bits(8, 8, 8, 8)
        window = panda.WindowProperties.size(*size)
        self._host = self._engine.make_output(
            pipe, "host", 0, plain, window, panda.GraphicsPipe.BF_refuse_window
        )
        self._surfaces, self._sums = self._buffer(1), self._buffer(0)
        planes = panda.GraphicsOutput
        for buffer, name, plane in (
            (self._surfaces, "base", planes.RTP_color),
            (self._surfaces, "stored", planes.RTP_aux_rgba_0),
            (self._surfaces, "depth", planes.RTP_depth),
            (self._sums, "color", planes.RTP_color),
        ):
            buffer.add_render_texture(self._textures[name], planes.RTM_bind_or_copy, plane)
            buffer.set_clear_color((0, 0, 0, 0))
        root = panda.NodePath("root")
        self._models, self._lights, self._eye = map(root.attach_new_node, ("models", "lights", "eye"))

    def _buffer(self, aux: int) -> panda.GraphicsOutput:
        wanted = panda.FrameBufferProperties()
        wanted.set_rgba_bits(8, 8, 8, 8)
        wanted.set_depth_bits(24)
        wanted.set_aux_rgba(aux)
        flags = panda.GraphicsPipe.BF_refuse_window | panda.GraphicsPipe.BF_can_bind_every
        host, size = self._host, panda.WindowProperties.size(*self._size)
        buffer = self._engine.make_output(
            host.get_pipe(), "buffer", 0, wanted, size, flags, host.get_gsg(), host
        )
        assert buffer is not None, "Panda3D has no such buffer here"
        return buffer

    def look(self, camera, a, c, near, far) -> None:
        """Place both cameras; `a` and `c` are what x and z are multiplied by, over y."""
        self._eye.set_mat(matrix(camera))
        lens = panda.PerspectiveLens()
        lens.set_focal_length(1.0)
        lens.set_film_size(2.0 / a, 2.0 / c)
        lens.set_near_far(near, far)
        for index, (buffer, root, state) in enumerate(
            ((self._surfaces, self._models, surface_state()), (self._sums, self._lights, self._light_state()))
        ):
            buffer.set_sort(index)
            camera = panda.Camera(f"camera {index}", lens)
            camera.set_scene(root)
            camera.set_initial_state(state)
            buffer.make_display_region().set_camera(self._eye.attach_new_node(camera))
        projection = lens.get_projection_mat()
        cells = [projection.get_cell(*at) for at in ((0, 0), (1, 2), (2, 1), (3, 2))]
        self._lights.set_shader_input("lens", panda.LVecBase4(*cells))

    def _light_state(self):
        node = panda.NodePath("state")
        node.set_shader(panda.Shader.make(panda.Shader.SL_GLSL, *LIGHT))
        for name in ("base", "stored", "depth"):
            node.set_shader_input(name, self._textures[name])
        one = panda.ColorBlendAttrib.O_one
        node.set_attrib(panda.ColorBlendAttrib.make(panda.ColorBlendAttrib.M_add, one, one))
        node.set_attrib(panda.CullFaceAttrib.make(panda.CullFaceAttrib.M_cull_counter_clockwise))
        node.set_depth_write(False)
        node.set_depth_test(False)
        return node.get_state()

    def add_part(self, vertices, triangles, placed, texture, two_sided) -> None:
        """Add a mesh."""
        path = self._models.attach_new_node(mesh(vertices, triangles))
        path.set_mat(matrix(placed))
        path.set_two_sided(bool(two_sided))
        if np.linalg.det(placed[:3, :3]) < 0 and not two_sided:
            path.set_attrib(panda.CullFaceAttrib.make_reverse())  # which Panda3D leaves to its user
        image = panda.Texture("image")
        height, width, _ = texture.shape
        image.setup_2d_texture(width, height, panda.Texture.T_unsigned_byte, panda.Texture.F_rgba)
        image.set_ram_image_as(texture.tobytes(), "RGBA")
        image.set_minfilter(panda.SamplerState.FT_linear)
        image.set_magfilter(panda.SamplerState.FT_linear)
        path.set_texture(image)

    def add_light(self, position, color, radius) -> None:
        """Add a light: a cube around all that it reaches."""
        corners = np.zeros((8, 12))
        corners[:, :3] = [[(i >> axis & 1) * 2 - 1 for axis in range(3)] for i in range(8)]
        path = self._lights.attach_new_node(mesh(corners, CUBE))
        path.set_pos(*position.tolist())
        path.set_scale(radius)
        place = self._eye.get_relative_point(self._lights, path.get_pos())
        path.set_shader_input("light", panda.LVecBase4(*place, radius))
        path.set_shader_input("tint", panda.LVecBase4(*color.tolist(), 1.0))

    def draw(self) -> dict[str, np.ndarray]:
        """The frame, shapes (height, width, 3), the first row on top."""
        self._engine.render_frame()
        images = {}
        for name, made in (("color", "color"), ("albedo", "base"), ("normal", "stored")):
            texture = self._textures[made]
            assert self._engine.extract_texture_data(texture, self._surfaces.get_gsg())
            codes = np.frombuffer(texture.get_ram_image_as("RGB"), dtype=np.uint8)
            images[name] = codes.reshape(*self._size[::-1], 3)[::-1]
        return images


CUBE = np.array(
    [
        (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
        (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5),
    ]
)  # fmt: skip


def surface_state():
    node = panda.NodePath("state")
    node.set_shader(panda.Shader.make(panda.Shader.SL_GLSL, *SURFACE))
    node.set_attrib(panda.AlphaTestAttrib.make(panda.RenderAttrib.M_greater_equal, 0.5))
    node.set_attrib(panda.DepthTestAttrib.make(panda.RenderAttrib.M_less_equal))
    return node.get_state()


def matrix(rows: np.ndarray) -> panda.LMatrix4f:
    return panda.LMatrix4f(*rows.ravel().tolist())


def mesh(vertices: np.ndarray, triangles: np.ndarray) -> panda.GeomNode:
    array = panda.GeomVertexArrayFormat()
    kind = panda.Geom
    for name, count, contents in (
        ("vertex", 3, kind.C_point),
        ("normal", 3, kind.C_normal),
        ("texcoord", 2, kind.C_texcoord),
        ("color", 4, kind.C_color),
    ):
        array.add_column(panda.InternalName.make(name), count, kind.NT_float32, contents)
    layout = panda.GeomVertexFormat.register_format(panda.GeomVertexFormat(array))
    data = panda.GeomVertexData("mesh", layout, kind.UH_static)
    data.unclean_set_num_rows(len(vertices))
    memoryview(data.modify_array(0)).cast("B")[:] = vertices.astype(np.float32).tobytes()
    faces = panda.GeomTriangles(kind.UH_static)
    faces.set_index_type(kind.NT_uint32)
    for corners in triangles.tolist():
        faces.add_vertices(*corners)
    geom = kind(data)
    geom.add_primitive(faces)
    node = panda.GeomNode("mesh")
    node.add_geom(geom)
    return node


if __name__ == "__main__":
    main(*sys.argv[1:])
