"""Animated WebP, APNG and GIF: frames, times and sizes, read back by Pillow, by FFmpeg and by hand."""

from __future__ import annotations

import io
import tracemalloc
from fractions import Fraction
from itertools import pairwise

import numpy as np
import PIL.Image
import PIL.ImageSequence
import pytest

from firefly_sample.encoding.films import FILMS, FilmChoices, film_facts, read_film, write_film
from firefly_sample.errors import FireflyError
from tests.encoding.moving import apng_delays, by_ffmpeg, moving, psnr, webp_frames, written

ANIMATIONS = (".webp", ".apng", ".gif")
RATES = [24, 12.5, 24000 / 1001, 1 / 3, 30, 49.5]


def by_pillow(path):
    """The number of milliseconds and the RGBA pixels of each frame."""
    with PIL.Image.open(path) as film:
        for picture in PIL.ImageSequence.Iterator(film):
            pixels = np.array(picture.convert("RGBA"))
            yield picture.info["duration"], pixels


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("suffix", [".webp", ".apng"])
def test_without_loss_every_bit_comes_back(tmp_path, suffix, channels):
    rng = np.random.default_rng(3)
    noise = [rng.integers(0, 256, (17, 33, channels), dtype=np.uint8) for _ in range(3)]
    some = noise[2].copy()
    some[3:9, 5:20] = 7  # the rest stays
    clear = np.where(rng.random((17, 33, 1)) < 0.5, some, some & np.uint8([255] * 3 + [0])[:channels])
    frames = [*noise, some, some, clear.astype(np.uint8), noise[0]]
    path = written(tmp_path / f"film{suffix}", frames, FilmChoices())
    assert np.array_equal(list(read_film(path)), frames)
    others = by_ffmpeg(path) if suffix == ".apng" else webp_frames(path.read_bytes())
    assert np.array_equal([pixels[..., :channels] for _, pixels in others], frames)


@pytest.mark.parametrize("suffix", [".webp", ".apng"])
def test_a_reader_may_say_how_many_channels_it_wants(tmp_path, suffix):
    opaque, clear = moving(2, channels=4)
    opaque[..., 3] = 255
    path = written(tmp_path / f"film{suffix}", [opaque, clear], FilmChoices())
    assert [frame.shape[2] for frame in read_film(path)] == [3, 4]
    assert np.array_equal(list(read_film(path, channels=4)), [opaque, clear])
    with pytest.raises(FireflyError, match="its frame 1 is not opaque"):
        list(read_film(path, channels=3))


@pytest.mark.parametrize("suffix", ANIMATIONS)
@pytest.mark.parametrize("fps", RATES)
def test_frame_k_begins_at_its_time(tmp_path, suffix, fps):
    rate = FilmChoices(fps).rate
    path = written(tmp_path / f"film{suffix}", moving(7), FilmChoices(fps))
    ticks = {".webp": 1000, ".gif": 100}.get(suffix)
    ends = np.cumsum([milliseconds for milliseconds, _ in by_pillow(path)])
    if ticks is None:
        assert np.allclose(ends, [float(1000 * k / rate) for k in range(1, 8)], rtol=1e-12, atol=0)
        assert list(apng_delays(path.read_bytes())) == [1 / rate] * 7
        assert film_facts(path).fps == rate
    else:
        assert list(ends) == [round(k * ticks / rate) * 1000 // ticks for k in range(1, 8)]
        assert film_facts(path).fps == Fraction(7000, int(ends[-1]))
    assert film_facts(path)[:2] == (7, (64, 48))


def test_a_gif_is_never_faster_than_browsers_show():
    for fps in (50, 49.9, 33, 40):
        starts = [round(k * 100 / FilmChoices(fps).rate) for k in range(500)]
        assert min(b - a for a, b in pairwise(starts)) >= 2


@pytest.mark.parametrize("suffix", ANIMATIONS)
def test_equal_frames_are_frames_all_the_same(tmp_path, suffix):
    first, second = moving(2)
    path = written(tmp_path / f"film{suffix}", [first, first, first, second, second], FilmChoices(10))
    assert [milliseconds for milliseconds, _ in by_pillow(path)] == [100] * 5
    back = list(read_film(path))
    assert len(back) == 5
    assert np.array_equal(back[0], back[2])
    assert np.array_equal(back[3], back[4])
    if suffix != ".webp":
        assert len(list(by_ffmpeg(path))) == 5
    else:
        assert [milliseconds for milliseconds, _ in webp_frames(path.read_bytes())] == [100] * 5


@pytest.mark.parametrize("suffix", ANIMATIONS)
def test_it_is_repeated_for_ever(tmp_path, suffix):
    with PIL.Image.open(written(tmp_path / f"film{suffix}", moving(2), FilmChoices())) as film:
        film.load()
        assert film.info["loop"] == 0


@pytest.mark.parametrize("suffix", ANIMATIONS)
def test_one_frame_is_a_film(tmp_path, suffix):
    frames = moving(1)
    path = written(tmp_path / f"film{suffix}", frames, FilmChoices())
    (back,) = read_film(path)
    assert back.shape == (48, 64, 3)
    assert film_facts(path).codec == suffix[1:]
    if FILMS[suffix].is_exact(FilmChoices()):
        assert np.array_equal(back, frames[0])


def test_a_gif_is_read_alike_by_pillow_and_ffmpeg(tmp_path):
    path = written(tmp_path / "film.gif", moving(5), FilmChoices())
    for (_, first), (_, second) in zip(by_pillow(path), by_ffmpeg(path), strict=True):
        assert np.array_equal(first[..., :3], second[..., :3])
        assert (first[..., 3] == 255).all()


@pytest.mark.parametrize("colors", [1, 2, 3, 200, 255])
def test_a_gif_of_few_colors_has_just_these(tmp_path, colors):
    """Colours that lie in different cells of the octree, and one more that is black."""
    palette = np.array([(k % 6 * 48, k // 6 % 6 * 48, k // 36 * 32) for k in range(colors)], np.uint8)
    first = palette[np.arange(48 * 64).reshape(48, 64) % colors]
    second = np.roll(first, 5, axis=1)
    second[:20] = first[:20]
    back = list(read_film(written(tmp_path / "film.gif", [first, second], FilmChoices())))
    assert np.abs(np.array(back, int) - [first, second]).max() <= (0 if colors <= 200 else 16)


def test_what_stays_in_a_gif_does_not_flicker(tmp_path):
    frames = moving(6)
    back = list(read_film(written(tmp_path / "film.gif", frames, FilmChoices())))
    for (before, after), (first, second) in zip(pairwise(frames), pairwise(back), strict=True):
        same = (before == after).all(axis=2)
        assert same.any()
        assert np.array_equal(first[same], second[same])


def test_lower_quality_of_webp_is_smaller_and_worse(tmp_path):
    frames = moving(4)
    good, bad = (written(tmp_path / f"{q}.webp", frames, FilmChoices(quality=q)) for q in (95, 30))
    assert good.stat().st_size > bad.stat().st_size
    assert psnr(list(read_film(good)), frames) > psnr(list(read_film(bad)), frames)
    rgba = moving(4, channels=4)
    back = list(read_film(written(tmp_path / "alpha.webp", rgba, FilmChoices(quality=90))))
    assert np.array_equal([image[..., 3] for image in back], [image[..., 3] for image in rgba])


@pytest.mark.parametrize("suffix", ANIMATIONS)
def test_memory_does_not_grow_with_the_number_of_frames(tmp_path, suffix):
    """NumPy's and Python's memory; frames of 262 kB would show at once if they were kept."""

    def peak(count):
        frame = np.zeros((256, 341, 3), np.uint8)

        def frames():
            for k in range(count):
                frame[0, 0] = k
                yield frame.copy()

        tracemalloc.start()
        write_film(tmp_path / "film", suffix, frames(), (341, 256), FilmChoices())
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    assert peak(9) < peak(3) + 262_000


@pytest.mark.parametrize("suffix", ANIMATIONS)
def test_the_same_frames_give_the_same_bytes(suffix, tmp_path):
    first, second = (written(tmp_path / name, moving(3), FilmChoices(), suffix).read_bytes() for name in "ab")
    assert first == second


@pytest.mark.parametrize("suffix", ANIMATIONS)
def test_an_open_file_is_as_good_as_a_path(tmp_path, suffix):
    file = io.BytesIO()
    write_film(file, suffix, moving(3), (64, 48), FilmChoices())
    assert file.getvalue() == written(tmp_path / f"film{suffix}", moving(3), FilmChoices()).read_bytes()
