"""Buffers and textures grow as their content needs it, and steady content makes no new ones."""

import numpy as np
import pytest

from firefly_sample.gpu.streams import Streams


@pytest.fixture
def streams(device):
    with device:
        made = Streams(device.ctx)
        yield made
        made.release()


def read_back(texture, shape):
    found = np.frombuffer(texture.read(), dtype=np.uint32).reshape(texture.height, texture.width, -1)
    return found[: shape[0], : shape[1]]


@pytest.mark.parametrize("components", [1, 4])
def test_a_table_holds_what_was_written_last_however_it_grows(streams, components):
    rng = np.random.default_rng(0)
    largest = 0, 0
    for height, width in [(2, 3), (5, 2), (3, 9), (1, 1), (20, 30), (20, 30), (19, 4)]:
        texels = rng.integers(0, 2**32, (height, width, components), dtype=np.uint32)
        texture = streams.texture("words", texels if components > 1 else texels[..., 0])
        assert np.array_equal(read_back(texture, texels.shape), texels)
        largest = max(largest[0], height), max(largest[1], width)
        assert texture.height <= 1.5 * largest[0]
        assert texture.width <= 1.5 * largest[1]


def test_what_fits_makes_no_texture(streams):
    first = streams.texture("words", np.ones((6, 8), dtype=np.uint32))
    for height, width in [(6, 8), (2, 8), (6, 1)]:
        assert streams.texture("words", np.zeros((height, width), dtype=np.uint32)) is first
    assert streams.texture("other", np.zeros((6, 8), dtype=np.uint32)) is not first
    assert streams.texture("words", np.zeros((6, 9), dtype=np.uint32)) is not first


def test_a_wide_table_and_a_high_one_take_turns_in_no_more_than_either_needs(streams):
    """As words do: few lights in a large picture, many in a small one."""
    for shape in [(40, 3000), (1700, 90), (40, 3000)]:
        texture = streams.texture("words", np.zeros((*shape, 4), dtype=np.uint32))
        assert texture.width * texture.height <= 2.5 * 1700 * 90


def test_an_exact_table_shrinks_too(streams):
    for shape in [(6, 8), (600, 800), (2, 3)]:
        texture = streams.texture("mesh", np.zeros((*shape, 4), dtype=np.uint32), exact=True)
        assert (texture.height, texture.width) == shape
        assert streams.texture("mesh", np.ones((*shape, 4), dtype=np.uint32), exact=True) is texture


def test_a_buffer_holds_what_was_written_last_and_grows_alone(streams):
    first = streams.buffer("rows", np.arange(20, dtype=np.float32))
    assert streams.buffer("rows", np.zeros(40, dtype=np.float32)) is first
    assert streams.buffer("rows", np.zeros(0, dtype=np.float32)) is first
    grown = np.arange(1000, dtype=np.float32)
    other = streams.buffer("rows", grown)
    assert other is not first
    assert other.read(grown.nbytes) == grown.tobytes()
    assert streams.buffer("more", grown) is not other
