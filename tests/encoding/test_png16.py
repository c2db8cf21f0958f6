"""Depth and ids with 16 bits: known codes, other libraries' reading, and what does not fit."""

from __future__ import annotations

import io

import av
import imageio.v3 as imageio
import numpy as np
import PIL.Image
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.encoding.format import Choices
from firefly_sample.encoding.png16 import Png16
from firefly_sample.errors import OutputError
from tests.encoding.images import assert_same_bits

KIND = Png16()


def depth_of(*numbers):
    return np.array([numbers], np.float32)


def codes_by_others(content):
    """The codes of a file as imageio and as FFmpeg read them."""
    with av.open(io.BytesIO(content)) as file:
        (frame,) = file.decode(video=0)
        assert frame.format.name == "gray16be"
        return imageio.imread(content), frame.to_ndarray(format="gray16le")


def test_codes_of_known_depths():
    depth = depth_of(0.001, 0.0014, 0.0016, 1, 1.2344, 65.535, np.inf)
    content = KIND.encode({"depth": depth}, Choices())
    for codes in codes_by_others(content):
        assert codes.dtype == np.uint16
        assert codes.tolist() == [[1, 1, 2, 1000, 1234, 65535, 0]]
    decoded = KIND.decode(content, ("depth",), Choices())["depth"]
    assert_same_bits(decoded, depth_of(0.001, 0.001, 0.002, 1, 1.234, 65.535, np.inf))


def test_codes_of_known_ids():
    ids = np.array([[-1, 0, 1, 254, 255, 65534]], np.int32)
    content = KIND.encode({"id": ids}, Choices())
    for codes in codes_by_others(content):
        assert codes.tolist() == [[0, 1, 2, 255, 256, 65535]]
    assert_same_bits(KIND.decode(content, ("id",), Choices())["id"], ids)


def test_one_code_is_the_chosen_number_of_units():
    content = KIND.encode({"depth": depth_of(3, 100)}, Choices(depth_scale=0.25))
    assert codes_by_others(content)[0].tolist() == [[12, 400]]
    assert KIND.decode(content, ("depth",), Choices(depth_scale=0.25))["depth"].tolist() == [[3, 100]]


@given(st.floats(1e-6, 1e3), st.lists(st.floats(1, 65535), max_size=20))
def test_the_error_is_half_a_code(scale, numbers):
    depth = np.array([[*numbers, 1]], np.float64) * scale
    depth = depth.astype(np.float32)
    choices = Choices(depth_scale=scale)
    decoded = KIND.decode(KIND.encode({"depth": depth}, choices), ("depth",), choices)["depth"]
    error = np.abs(decoded.astype(np.float64) - depth.astype(np.float64))
    rounding = np.spacing(np.maximum(decoded, depth)).astype(np.float64) / 2
    assert (error <= scale / 2 * (1 + 1e-9) + rounding).all()


@given(st.lists(st.integers(-1, 65534), min_size=1, max_size=50))
def test_every_id_comes_back(numbers):
    ids = np.array([numbers], np.int32)
    assert_same_bits(KIND.decode(KIND.encode({"id": ids}, Choices()), ("id",), Choices())["id"], ids)


@pytest.mark.parametrize(
    ("depth", "scale", "message"),
    [
        (
            depth_of(0.5, 65.536),
            0.001,
            "the largest depth is 65.536, and png16 ends at 65.535 with depth_scale 0.001: "
            "set depth_scale to 0.0011, or choose npz or exr",
        ),
        (
            depth_of(2, 5000, np.inf),
            0.001,
            "the largest depth is 5000, and png16 ends at 65.535 with depth_scale 0.001: "
            "set depth_scale to 0.077, or choose npz or exr",
        ),
        (
            depth_of(0.0004, 1),
            0.001,
            "the smallest depth is 0.0004, and png16 begins at 0.001 with depth_scale 0.001: "
            "set depth_scale to 0.00039, or choose npz or exr",
        ),
        (
            depth_of(0.0625, 1e6),
            0.001,
            "the largest depth is 1e+06, and png16 ends at 65.535 with depth_scale 0.001: "
            "no depth_scale holds 0.0625 to 1e+06, choose npz or exr",
        ),
        (
            depth_of(-2, 3),
            0.5,
            "the smallest depth is -2, and png16 begins at 0.5 with depth_scale 0.5: "
            "no depth_scale holds -2 to 3, choose npz or exr",
        ),
        (
            depth_of(np.nan, 3),
            0.5,
            "the smallest depth is nan, and png16 begins at 0.5 with depth_scale 0.5: "
            "no depth_scale holds nan to nan, choose npz or exr",
        ),
    ],
)
def test_a_depth_that_does_not_fit(depth, scale, message):
    with pytest.raises(OutputError) as caught:
        KIND.encode({"depth": depth}, Choices(depth_scale=scale))
    assert str(caught.value) == f"output 'depth': {message}"


@given(st.floats(1e-20, 1e20), st.floats(1, 50_000), st.floats(1e-6, 1e6))
def test_the_scale_of_the_message_does(lowest, ratio, scale):
    depth = depth_of(lowest, lowest * ratio)
    try:
        KIND.encode({"depth": depth}, Choices(depth_scale=scale))
    except OutputError as error:
        better = float(str(error).split("set depth_scale to ")[1].split(",")[0])
        KIND.encode({"depth": depth}, Choices(depth_scale=better))


@pytest.mark.parametrize(
    ("number", "message"),
    [
        (65535, "the largest id is 65535, and png16 ends at 65534: choose npz or exr"),
        (2**31 - 1, "the largest id is 2147483647, and png16 ends at 65534: choose npz or exr"),
        (-2, "the smallest id is -2, and png16 begins at -1"),
    ],
)
def test_an_id_that_does_not_fit(number, message):
    with pytest.raises(OutputError) as caught:
        KIND.encode({"id": np.array([[0, number]], np.int32)}, Choices())
    assert str(caught.value) == f"output 'id': {message}"


def test_files_that_tools_have_made_smaller_are_the_same():
    """They store 16-bit codes of two equal bytes with 8 bits, and black and white with one."""
    for codes, mode in (([[0, 1, 200, 255]], "L"), ([[0, 255, 0, 255]], "1")):
        file = io.BytesIO()
        PIL.Image.fromarray(np.array(codes, np.uint8)).convert(mode).save(file, format="PNG")
        ids = KIND.decode(file.getvalue(), ("id",), Choices())["id"]
        assert_same_bits(ids, np.array(codes, np.int32) * 257 - 1)


def test_a_picture_is_no_depth():
    file = io.BytesIO()
    PIL.Image.fromarray(np.zeros((2, 2, 3), np.uint8)).save(file, format="PNG")
    with pytest.raises(ValueError, match="RGB has no 16-bit codes"):
        KIND.decode(file.getvalue(), ("depth",), Choices())
