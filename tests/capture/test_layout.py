"""Each file of a capture has one name, and only such names are recognised."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.capture.layout import LAYERS, MASKS, SUFFIXES, BopLayout, FlatLayout, Layout
from firefly_sample.frame import OUTPUTS

FLAT, BOP = FlatLayout(), BopLayout()
KEYS = st.sampled_from((*OUTPUTS, LAYERS))
MASK_KEYS = st.builds("{}/{}".format, st.sampled_from(MASKS), st.integers(0, 10**7))
INDICES = st.integers(0, 10**8)
SUFFIX = st.sampled_from(SUFFIXES)


@pytest.mark.parametrize(
    ("layout", "key", "suffix", "path"),
    [
        (FLAT, "color", ".png", "color_000012.png"),
        (FLAT, "color_alpha", ".webp", "color_alpha_000012.webp"),
        (FLAT, "depth", ".npz", "depth_000012.npz"),
        (FLAT, "layers", ".exr", "layers_000012.exr"),
        (BOP, "color", ".png", "rgb/000012.png"),
        (BOP, "color", ".jpg", "rgb/000012.jpg"),
        (BOP, "depth", ".png", "depth/000012.png"),
        (BOP, "mask/3", ".png", "mask/000012_000003.png"),
        (BOP, "mask_visib/3", ".png", "mask_visib/000012_000003.png"),
        (BOP, "normal", ".npz", "normal/000012.npz"),
        (BOP, "layers", ".exr", "layers/000012.exr"),
    ],
)
def test_a_file_has_the_name_that_readers_expect(layout: Layout, key: str, suffix: str, path: str):
    assert layout.path(key, 12, suffix) == path
    assert layout.parse(path) == (key, 12)


@given(KEYS, INDICES, SUFFIX)
def test_a_flat_name_is_recognised(key: str, index: int, suffix: str):
    assert FLAT.parse(FLAT.path(key, index, suffix)) == (key, index)
    assert BOP.parse(FLAT.path(key, index, suffix)) is None


@given(KEYS | MASK_KEYS, INDICES, SUFFIX)
def test_a_name_of_bop_is_recognised(key: str, index: int, suffix: str):
    path = BOP.path(key, index, suffix)
    assert BOP.parse(path) == (key, index)
    assert FLAT.parse(path) is None
    folder = path.rpartition("/")[0]
    assert folder in BOP.folders()
    assert BOP.folders([key]) == (folder,)


NEARLY = st.one_of(
    st.text(),
    st.from_regex(r"([a-z_]+[_/])+[0-9_]{1,9}\.?[a-zA-Z.]{0,8}\n?", fullmatch=True),
    st.builds(
        lambda folder, text, suffix: folder + text + suffix,
        st.sampled_from(["color_", "rgb/", "color/", "mask/", "mask_visib/", "x/rgb/", "rgb//", "depth_"]),
        st.text("0123456789_-+ ٣²", max_size=14),
        st.sampled_from([*SUFFIXES, "", ".PNG", ".txt", ".png\n", ".part"]),
    ),
)


@given(st.sampled_from([FLAT, BOP]), NEARLY)
def test_only_its_own_names_are_recognised(layout: Layout, path: str):
    found = layout.parse(path)
    if found is not None:
        assert path in {layout.path(*found, suffix) for suffix in SUFFIXES}


@pytest.mark.parametrize(
    "path",
    [
        "color_12.png",
        "color_0000012.png",
        "color_000012.txt",
        "color_000012.png\n",
        "colour_000012.png",
        "mask_000012.png",
        "sub/color_000012.png",
        "color_٠٠٠٠١٢.png",
    ],
)
def test_another_file_is_not_a_flat_name(path: str):
    assert FLAT.parse(path) is None


@pytest.mark.parametrize(
    "path",
    [
        "color/000012.png",
        "rgb/12.png",
        "rgb/000012_000001.png",
        "mask/000012.png",
        "mask/000012_1.png",
        "./rgb/000012.png",
        "scene_gt.json",
    ],
)
def test_another_file_is_not_a_name_of_bop(path: str):
    assert BOP.parse(path) is None


def test_a_capture_makes_the_folders_of_what_it_writes():
    assert FLAT.folders(["color", "depth"]) == ("",)
    assert BOP.folders(["color", "depth", "mask/0", "mask/1"]) == ("rgb", "depth", "mask")
    assert set(BOP.folders()) >= {"rgb", "depth", "mask", "mask_visib", "normal", "layers"}
