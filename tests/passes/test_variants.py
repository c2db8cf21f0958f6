"""The legal variants of every pass compile on this driver, and uniforms are checked both ways."""

import numpy as np
import pytest

from firefly_sample.errors import GpuError, ShaderError
from firefly_sample.gpu import programs as programs_module
from firefly_sample.gpu.programs import Programs
from firefly_sample.gpu.shader_source import load_source
from firefly_sample.plan.legal_variants import legal_variants
from firefly_sample.plan.variants import PASS_ORDER, AmbientVariant, defines
from tests.every_three import every_three

GBUFFER = {
    "albedo": "albedo",
    "normal": "normal",
    "distance": "distance",
    "ambient_albedo": "ambient",
    "specular": "specular",
    "emission": "emission",
    "id": "id",
    "visibility": "visibility",
}
"""Targets of the geometry pass and the fields of its variant."""

NOT_SHADERS = ("depth_copy",)
FULLSCREEN = (
    *("interpolation", "ambient", "half_depth", "upsample", "resolve", "particle_light"),
    *("particle_shadow_sums", "particle_shadow_blur_x", "particle_shadow_blur_y", "particle_shadow_texture"),
)
FIXED = {
    "plain": ("radiance",),
    "particles": ("particles",),
    "particle_light": ("particle_light",),
    "particle_shadow_slices": ("particle_shadow_atlas",),
    "particle_shadow_sums": ("particle_shadow_atlas",),
    "particle_shadow_blur_x": ("particle_shadow_scratch",),
    "particle_shadow_blur_y": ("particle_shadow_atlas",),
    "particle_shadow_texture": ("color",),
}
"""Targets of passes whose variants do not choose."""


def outputs_of(name, variant):
    if name in ("geometry", "interpolation"):
        stored = ("position",) if variant.stored != "none" else ()
        return (*(target for target, field in GBUFFER.items() if getattr(variant, field, False)), *stored)
    if name == "forward":
        return ("coverage", "radiance")
    if name == "half_depth":
        return ()
    if name == "resolve":
        return tuple(target for target in ("color", "final_radiance") if getattr(variant, target))
    if name in FIXED:
        return FIXED[name]
    if name == "shadow_maps":
        return ()
    if name in ("overdraw", "volumes", "wireframe"):
        return (name,)
    return tuple(target for target in ("radiance", "light") if getattr(variant, target))


def shaders_of(name, method=""):
    """The stems of a pass's fragment shader and of the vertex shaders that it is drawn with."""
    if name in ("overdraw", "volumes", "wireframe"):
        kinds = ("point_lights", "spotlights", "directional_lights")
        kinds = kinds[1:2] if method == "cone" else kinds
        return "light_views", ("fullscreen",) if method == "clustered" else kinds
    if name == "forward":
        return name, ("geometry",)
    return name, ("fullscreen",) if name in FULLSCREEN else (name,)


@pytest.mark.parametrize("name", [name for name in PASS_ORDER if name not in NOT_SHADERS])
def test_the_legal_variants_compile(device, name, request):
    """Every three choices together; with --all-variants, every variant that a plan can hold."""
    variants = legal_variants(name)
    assert variants
    assert len(set(variants)) == len(variants)
    values = np.array([list(defines(variant).values()) for variant in variants])
    assert np.isin(values, (0, 1, 2, 3, 4, 5, 16)).all()  # defines are small whole numbers
    if not request.config.getoption("--all-variants") and values.size:
        # a slip in a shader's conditions is one of two or three of them; variants differ in more
        variants = [variants[row] for row in every_three(values)]
    with device:
        for first in range(0, len(variants), 500):  # compiled programs are kept in memory
            programs = Programs(device.ctx)
            for variant in variants[first : first + 500]:
                stem, vertices = shaders_of(name, getattr(variant, "method", ""))
                for vertex in vertices:
                    programs.get(stem, variant, outputs_of(name, variant), vertex)
            programs.release()
        device.check("compiling")


def test_a_missing_and_a_misspelt_uniform_are_errors(device):
    with device:
        programs = Programs(device.ctx)
        program = programs.get("ambient", AmbientVariant(), ("radiance",), "fullscreen")
        with pytest.raises(GpuError, match="'u_albedo' is not given"):
            program.use()
        texture = device.ctx.texture((1, 1), 4)
        with pytest.raises(GpuError, match="no uniform 'u_albdo'"):
            program.use(None, {"u_albedo": texture, "u_albdo": texture})
        texture.release()
        programs.release()


def test_a_shader_that_does_not_compile_names_file_and_line(device, tmp_path, monkeypatch):
    include = tmp_path / "include"
    include.mkdir()
    (tmp_path / "bad.vert").write_text("#version 330 core\nvoid main() { gl_Position = vec4(0.0); }\n")
    (include / "half.glsl").write_text("// fine\nfloat half_of(float x)\n{\n    return x * 0.5\n}\n")
    (tmp_path / "bad.frag").write_text('#version 330 core\n#include "include/half.glsl"\nvoid main() {}\n')
    monkeypatch.setattr(
        programs_module, "load_source", lambda name, given: load_source(name, given, tmp_path)
    )
    with device, pytest.raises(ShaderError) as caught:
        Programs(device.ctx).get("bad", AmbientVariant(), ())
    # the compiler may point at the line itself or at the token after it
    assert str(caught.value).startswith(("include/half.glsl:4: ", "include/half.glsl:5: "))
    assert "\n" not in str(caught.value)


def test_includes_come_once_and_a_missing_one_is_named(tmp_path):
    (tmp_path / "a.glsl").write_text("float a;\n")
    (tmp_path / "b.glsl").write_text('#include "a.glsl"\nfloat b;\n')
    (tmp_path / "s.frag").write_text(
        '#version 330 core\n#include "a.glsl"\n#include "b.glsl"\nvoid main() {}\n'
    )
    source = load_source("s.frag", {"X": 1}, tmp_path)
    assert source.text.splitlines() == [
        "#version 330 core",
        "#define X 1",
        "float a;",
        "float b;",
        "void main() {}",
    ]
    assert source.origins[3] == ("b.glsl", 2)
    (tmp_path / "s.frag").write_text('#version 330 core\n#include "gone.glsl"\n')
    with pytest.raises(ShaderError, match=r"gone\.glsl"):
        load_source("s.frag", {}, tmp_path)
    (tmp_path / "s.frag").write_text("#version 330 core\n#block Nowhere\n")
    with pytest.raises(ShaderError, match=r"s\.frag:2: there is no uniform block 'Nowhere'"):
        load_source("s.frag", {}, tmp_path)
