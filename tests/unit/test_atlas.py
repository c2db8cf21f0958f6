"""Tiles in an atlas: inside it, apart from each other, and not wasteful."""

from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.plan.shadows.maps import pack_atlas

sizes = st.lists(st.sampled_from([16, 33, 64, 100, 128, 256, 512, 1024]), max_size=60)


@given(sizes)
def test_tiles_lie_inside_and_do_not_touch_each_other(given_sizes):
    packed = pack_atlas(tuple(given_sizes), 8192)
    assert packed is not None
    (width, height), tiles = packed
    assert [tile.size for tile in tiles] == given_sizes
    assert max(width, height, 0) <= 8192
    taken = set()
    for tile in tiles:
        assert tile.x >= 0
        assert tile.y >= 0
        assert tile.x + tile.size <= width
        assert tile.y + tile.size <= height
    for i, a in enumerate(tiles):
        for b in tiles[:i]:
            apart = a.x + a.size <= b.x or b.x + b.size <= a.x or a.y + a.size <= b.y or b.y + b.size <= a.y
            assert apart
        taken.add((a.x, a.y))
    assert len(taken) == len(tiles)


@given(st.integers(1, 64), st.sampled_from([16, 256, 1024]))
def test_equal_tiles_waste_at_most_their_last_row(count, size):
    (width, height), _ = pack_atlas((size,) * count, 8192)
    assert width * height < count * size**2 + width * size


def test_the_smallest_atlas_that_fits_is_found_or_none():
    assert pack_atlas((), 8192) == ((0, 0), ())
    (width, height), _ = pack_atlas((1024,) * 64, 8192)
    assert (width, height) == (8192, 8192)
    assert pack_atlas((1024,) * 65, 8192) is None
    assert pack_atlas((8193,), 8192) is None
    (width, height), _ = pack_atlas((1024,) * 6, 8192)
    assert sorted((width, height)) == [2048, 3072]
