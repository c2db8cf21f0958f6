"""Which format each output gets, in the words of users, and what they are told."""

from __future__ import annotations

import json
import pickle
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.encoding.format import Choices
from firefly_sample.encoding.formats import FORMATS, LAYERS, Encoding, format_of_path, formats_for
from firefly_sample.errors import MissingPackageError, OutputError
from firefly_sample.frame import OUTPUTS
from tests.encoding.images import assert_same_bits, image_of

FEW = ("color", "depth", "id", "normal")


@pytest.mark.parametrize(
    ("formats", "wanted"),
    [
        (None, "png npz npz npz"),
        ((), "png npz npz npz"),
        ({}, "png npz npz npz"),
        ("png", "png npz npz npz"),
        ("webp", "webp npz npz npz"),
        ("webp,exr", "webp exr exr exr"),
        (" webp , depth = png16 ", "webp png16 npz npz"),
        (["webp", "depth=png16,exr"], "webp png16 exr exr"),
        (("exr", "depth=npz", "id=npz"), "png npz npz exr"),
        ("png16,normal=exr16", "png png16 png16 exr16"),
        ({"normal": "exr", "color": "jpeg"}, "jpeg npz npz exr"),
        ("npz,depth=exr,normal=exr16", "png exr npz exr16"),
    ],
)
def test_formats_of_outputs(formats, wanted):
    encoding = Encoding.of(FEW, formats)
    assert encoding.formats == tuple(zip(FEW, wanted.split(), strict=True))
    assert encoding.choices == Choices()


@pytest.mark.parametrize(
    ("formats", "message"),
    [
        ("jpg", "there is no format 'jpg' (did you mean 'jpeg'?): choose from png, webp, jpeg, npz, png16,"),
        ("tga", "there is no format 'tga': choose from png, webp,"),
        ("", "there is no format '': choose from png"),
        ("png,", "there is no format '': choose from png"),
        ("depth=", "there is no format '': choose from png"),
        ({"depth": None}, "there is no format None"),
        ([7], "a format is a name such as 'png' or a pair such as 'depth=png16', got 7"),
        ("=png", "there is no output ''"),
        ("colour=png", "there is no output 'colour' (did you mean 'color'?)"),
        (
            "albedo=exr",
            "output 'albedo' has the format exr, but is not asked for: "
            "add it to the outputs color, depth, id, normal, or leave its format out",
        ),
        (
            "color=png,color=webp",
            "output 'color' has two formats, png and webp: choose one, for example color=webp",
        ),
        ("webp,jpeg", "output 'color' has two formats, webp and jpeg: choose one"),
        ("png16,exr", "output 'depth' has two formats, png16 and exr: choose one, for example depth=exr"),
        (
            "normal=png16",
            "png16 cannot hold the output 'normal': it is for depth and id; choose npz, exr, exr16",
        ),
        (
            "color=exr",
            "exr cannot hold the output 'color': it is for light and data, and the output 'radiance' is the "
            "picture as light; choose png, webp, jpeg",
        ),
        (
            "webp,color=png",
            "the format webp is for none of the outputs: color (it is png), "
            "depth (it is for 8-bit pictures), "
            "id (it is for 8-bit pictures), normal (it is for 8-bit pictures); leave it out, or ask for one "
            "of color, color_alpha, volumes, wireframe",
        ),
    ],
)
def test_formats_that_cannot_be(formats, message):
    with pytest.raises(OutputError) as caught:
        Encoding.of(FEW, formats)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("outputs", "formats", "message"),
    [
        ("color_alpha", "jpeg", r"color_alpha \(it has no alpha\); .* color, volumes, wireframe$"),
        ("color", "exr", r"^the format exr is for none .* or ask for one of radiance, albedo,"),
        ("shadow_atlas", "exr", r"shadow_atlas \(its size is not the picture's\)"),
        ("shadow_atlas", "shadow_atlas=exr", r"its size is not the picture's; choose npz$"),
        ("color_alpha", {"color_alpha": "jpeg"}, r"it has no alpha; choose png, webp$"),
    ],
)
def test_outputs_that_a_format_cannot_hold(outputs, formats, message):
    with pytest.raises(OutputError, match=message):
        Encoding.of([outputs], formats)


def test_numbers_are_checked():
    of = Encoding.of
    for number in (0, 101, 50.0, "50", True):
        with pytest.raises(OutputError, match=r"^quality is a whole number from 1 to 100, got "):
            of(["color"], "webp", quality=number)
    for number in (0, -1, np.nan, np.inf, "x", [1], True, 1e-31, 1e31):
        with pytest.raises(OutputError, match=r"^depth_scale is a number from 1e-30 to 1e\+30, got "):
            of(["depth"], "png16", depth_scale=number)
    with pytest.raises(
        OutputError, match=r"^quality is 80, but no output is WebP or JPEG: .* choose webp or"
    ):
        of(["color", "depth"], "exr", quality=80)
    for outputs, formats in ((["depth"], "exr"), (["id", "depth"], "id=png16")):
        with pytest.raises(OutputError, match=r"^depth_scale is 0.01, but no output 'depth' is png16: leave"):
            of(outputs, formats, depth_scale=0.01)
    given_numbers = of(["color", "depth"], "webp,png16", np.int64(80), np.float32(0.5))
    assert given_numbers.choices == Choices(80, 0.5)
    assert of(["depth"], "png16", depth_scale=2).as_json()["depth_scale"] == 2.0


def test_only_numbers_that_files_depend_on_are_described():
    of = Encoding.of
    assert of(["color"]).as_json() == {"formats": {"color": "png"}}
    assert of(["color"], "webp").as_json() == {"formats": {"color": "webp"}}
    assert of(["color"], "jpeg", 70).as_json() == {"formats": {"color": "jpeg"}, "quality": 70}
    assert of(["depth"], "png16").as_json() == {"formats": {"depth": "png16"}, "depth_scale": 0.001}
    assert of(["id"], "png16").as_json() == {"formats": {"id": "png16"}}


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"formats": "png"},
        {"formats": {}},
        {"formats": {"color": "gif"}},
        {"formats": {"colour": "png"}},
        {"formats": {"color": "png"}, "speed": 3},
        {"formats": {"color": "webp"}, "quality": "high"},
        {"formats": {"depth": "png16"}, "depth_scale": [1]},
    ],
)
def test_a_description_that_is_wrong(values):
    with pytest.raises(OutputError):
        Encoding.from_json(values)


assignments = st.lists(st.sampled_from(list(OUTPUTS)), min_size=1, unique=True).flatmap(
    lambda outputs: st.fixed_dictionaries(
        {output: st.sampled_from(formats_for(output)) for output in outputs}
    )
)


@given(assignments, st.integers(1, 100), st.floats(1e-30, 1e30))
def test_however_it_is_said(formats, quality, scale):
    names = set(formats.values())
    numbers = {
        **({"quality": quality} if names & {"webp", "jpeg"} else {}),
        **({"depth_scale": scale} if formats.get("depth") == "png16" else {}),
    }
    encoding = Encoding.of(formats, formats, **numbers)
    assert dict(encoding.formats) == formats
    pairs = [f"{output}={name}" for output, name in formats.items()]
    assert Encoding.of(formats, ",".join(pairs), **numbers) == encoding
    assert Encoding.of(formats, reversed(pairs), **numbers) == encoding
    assert Encoding.from_json(json.loads(json.dumps(encoding.as_json()))) == encoding
    assert pickle.loads(pickle.dumps(encoding)) == encoding
    assert hash(pickle.loads(pickle.dumps(encoding))) == hash(encoding)
    held = [output for outputs in encoding.files().values() for output in outputs]
    assert sorted(held) == sorted(formats)
    for file, outputs in encoding.files().items():
        assert file == LAYERS or outputs == (file,)
        assert encoding.suffix(file) == FORMATS[formats[outputs[0]]].suffixes[0]


@given(st.lists(st.sampled_from([*FORMATS, *(f"{o}={f}" for o in OUTPUTS for f in FORMATS)]), max_size=4))
def test_a_list_is_understood_or_refused(formats):
    try:
        encoding = Encoding.of(OUTPUTS, formats)
    except OutputError:
        return
    chosen = dict(encoding.formats)
    for text in formats:
        output, sign, name = text.partition("=")
        assert chosen[output] == name if sign else text in chosen.values()


def test_floats_of_two_kinds_share_a_file():
    outputs = ("radiance", "color", "depth", "id")
    encoding = Encoding.of(outputs, "radiance=exr16,exr")
    assert encoding.files() == {LAYERS: ("radiance", "depth", "id"), "color": ("color",)}
    assert encoding.suffix(LAYERS) == ".exr"
    assert [encoding.is_exact(output) for output in outputs] == [False, True, True, True]
    images = {output: image_of(output) for output in outputs}
    images["radiance"] = np.full_like(images["radiance"], 1 / 3)
    decoded = encoding.decode(LAYERS, encoding.encode(LAYERS, images))
    assert tuple(decoded) == ("radiance", "depth", "id")
    assert_same_bits(decoded["depth"], images["depth"])
    assert_same_bits(decoded["radiance"], images["radiance"].astype(np.float16).astype(np.float32))


def test_formats_of_paths():
    names = {
        "a.png": "png",
        "b/c.PNG": "png",
        "a.webp": "webp",
        "a.jpg": "jpeg",
        "a.jpeg": "jpeg",
        "a.npz": "npz",
        "a.b.exr": "exr",
    }
    assert {path: format_of_path(path).name for path in names} == names
    for path in ("a.gif", "png", ".png", "a", ""):
        assert format_of_path(path) is None


def test_packages_are_asked_for_only_where_they_are_needed(monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    Encoding.of(FEW, "webp,depth=png16").require()
    exr = Encoding.of(FEW, "exr")
    with pytest.raises(MissingPackageError, match="OpenEXR"):
        exr.require()
