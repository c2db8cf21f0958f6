"""The legal variants of every pass compile on this driver, and uniforms are checked both ways."""

from dataclasses import fields
from itertools import combinations
from itertools import product as cartesian

import numpy as np
import pytest

from firefly_sample.errors import GpuError, ShaderError
from firefly_sample.gpu.programs import Programs
from firefly_sample.gpu.shader_source import load_source
from firefly_sample.passes.fullscreen import AmbientVariant
from firefly_sample.passes.legal import as_products
from firefly_sample.pipeline import PASSES
from firefly_sample.plan.variants import SHADER_CONSTANTS, number_of
from tests.every_three import every_three


def values_by_field(product):
    """The values that each field has in a product's variants."""
    return {name: {choice[name] for choice in part} for part in product.parts for name in part[0]}


@pytest.mark.parametrize("kind", PASSES, ids=lambda kind: kind.name)
def test_the_legal_variants_are_distinct_and_their_defines_small_whole_numbers(kind):
    products = as_products(kind().legal_variants()).products
    for product in products:
        for part in product.parts:
            assert len({tuple(choice.values()) for choice in part}) == len(part) > 0
    values = list(map(values_by_field, products))
    for one, other in combinations(values, 2):
        assert any(one[name].isdisjoint(other[name]) for name in one)
    numbers = {
        number_of(name, value)
        for each in values
        for name in each
        for value in each[name]
        if value is not None and not isinstance(value, tuple)
    }
    assert numbers <= {0, 1, 2, 3, 4, 5, 16}


def table_of(part, names, sets):
    """The numbers of a part's fields, and those of their values in each choice.

    A tuple of sets of lights has its number in `sets`, by what other fields do not tell of them.
    """

    def number(name, value):
        if value is None or isinstance(value, tuple):
            kinds = tuple((each.light_kind, each.falloff) for each in value or ())
            return sets.setdefault(kinds, len(sets))
        return number_of(name, value)

    table = [[number(name, value) for name, value in choice.items()] for choice in part]
    return [names.index(name) for name in part[0]], np.array(table)


@pytest.mark.parametrize("kind", PASSES, ids=lambda kind: kind.name)
def test_the_legal_variants_compile(device, kind, request):
    """Every three choices together; with --all-variants, every variant that a plan can hold."""
    made = kind()
    legal = as_products(made.legal_variants())
    names = [field.name for field in fields(legal.products[0].kind)]
    if request.config.getoption("--all-variants") or not names:
        variants = list(legal)
    else:
        # a slip in a shader's conditions is one of two or three of them; variants differ in more
        sets = {}
        tables = [[table_of(part, names, sets) for part in product.parts] for product in legal.products]
        chosen = [(legal.products[index], rows) for index, rows in every_three(tables)]
        variants = [
            product.variant(part[row] for part, row in zip(product.parts, rows, strict=True))
            for product, rows in chosen
        ]
    assert variants
    with device:
        for first in range(0, len(variants), 500):  # compiled programs are kept in memory
            programs = Programs(device.ctx)
            for variant in variants[first : first + 500]:
                for stem, vertex in made.shader_stems(variant):
                    programs.get(stem, variant, made.outputs(variant), vertex)
            programs.release()
        device.check("compiling")


def test_every_three_choices_of_some_cases_are_among_those_chosen():
    """Against a list of all cases, of two products whose parts differ."""
    random = np.random.default_rng(1)
    products = [
        [
            ([0, 3], random.integers(0, 4, (9, 2))),
            ([1], np.array([[0], [2]])),
            ([4, 2], random.integers(0, 3, (5, 2))),
        ],
        [([2, 1, 0], random.integers(0, 3, (20, 3))), ([3, 4], np.array([[5, 0], [5, 4], [0, 4]]))],
    ]

    def case(parts, rows):
        made = np.zeros(5, int)
        for (columns, table), row in zip(parts, rows, strict=True):
            made[columns] = table[row]
        return made.tolist()

    def threes(cases):
        return {(three, tuple(row[k] for k in three)) for row in cases for three in combinations(range(5), 3)}

    every = [
        case(parts, rows)
        for parts in products
        for rows in cartesian(*(range(len(table)) for _, table in parts))
    ]
    chosen = [case(products[index], rows) for index, rows in every_three(products)]
    assert threes(chosen) == threes(every)
    assert len(chosen) < len(every) / 2


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
