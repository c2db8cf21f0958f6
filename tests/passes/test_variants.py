"""The legal variants of every pass compile on this driver, and uniforms are checked both ways."""

import numpy as np
import pytest

from firefly_sample.errors import GpuError, ShaderError
from firefly_sample.gpu.programs import Programs
from firefly_sample.gpu.shader_source import load_source
from firefly_sample.passes.fullscreen import AmbientVariant
from firefly_sample.pipeline import PASSES
from firefly_sample.plan.variants import SHADER_CONSTANTS, defines
from tests.every_three import every_three


@pytest.mark.parametrize("kind", PASSES, ids=lambda kind: kind.name)
def test_the_legal_variants_compile(device, kind, request):
    """Every three choices together; with --all-variants, every variant that a plan can hold."""
    made = kind()
    variants = list(made.legal_variants())
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
                for stem, vertex in made.shader_stems(variant):
                    programs.get(stem, variant, made.outputs(variant), vertex)
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


def test_a_shader_that_does_not_compile_names_file_and_line(device, tmp_path):
    include = tmp_path / "include"
    include.mkdir()
    (tmp_path / "bad.vert").write_text("#version 330 core\nvoid main() { gl_Position = vec4(0.0); }\n")
    (include / "half.glsl").write_text("// fine\nfloat half_of(float x)\n{\n    return x * 0.5\n}\n")
    (tmp_path / "bad.frag").write_text('#version 330 core\n#include "include/half.glsl"\nvoid main() {}\n')
    with device, pytest.raises(ShaderError) as caught:
        Programs(device.ctx).get("bad", AmbientVariant(), (), folder=tmp_path)
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
    constants = [f"#define {name} {number}" for name, number in SHADER_CONSTANTS.items()]
    assert source.text.splitlines() == [
        "#version 330 core",
        *constants,
        "#define X 1",
        "float a;",
        "float b;",
        "void main() {}",
    ]
    assert source.origins[len(constants) + 3] == ("b.glsl", 2)
    (tmp_path / "s.frag").write_text('#version 330 core\n#include "gone.glsl"\n')
    with pytest.raises(ShaderError, match=r"gone\.glsl"):
        load_source("s.frag", {}, tmp_path)
    (tmp_path / "s.frag").write_text("#version 330 core\n#block Nowhere\n")
    with pytest.raises(ShaderError, match=r"s\.frag:2: there is no uniform block 'Nowhere'"):
        load_source("s.frag", {}, tmp_path)
