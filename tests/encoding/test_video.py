"""MP4 and WebM: colours, times, tags, bytes; read back by FFmpeg's decoders and by hand."""

from __future__ import annotations

import os
import struct
from fractions import Fraction

import numpy as np
import pytest

from firefly_sample.encoding.films import FilmChoices, film_facts, read_film
from tests.encoding.moving import box, boxes, by_ffmpeg, moving, psnr, written

VIDEOS = (".mp4", ".webm")

COLORS = (
    *((255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255), (0, 0, 0)),
    *((255, 255, 0), (0, 255, 255), (255, 0, 255), (8, 12, 20), (128, 128, 128)),
)


@pytest.mark.parametrize("suffix", VIDEOS)
def test_flat_colors_come_back_within_two_codes(tmp_path, suffix):
    """Half a code of Y and of a chroma are 0.5 * 255/219 + 0.5 * 255/224 * 1.8556 = 1.64 codes of blue."""
    frames = [np.full((48, 64, 3), color, np.uint8) for color in COLORS]
    back = list(read_film(written(tmp_path / f"film{suffix}", frames, FilmChoices(crf=1))))
    assert len(back) == len(frames)
    assert np.abs(np.array(back, int) - frames).max() <= 2


@pytest.mark.parametrize("suffix", VIDEOS)
def test_the_numbers_in_the_file_are_those_of_bt_709(tmp_path, suffix):
    """Y, Cb and Cr of ITU-R BT.709, with sRGB's codes as R', G' and B', from the decoded planes."""
    import av

    frames = [np.full((48, 64, 3), color, np.uint8) for color in COLORS]
    written(tmp_path / f"film{suffix}", frames, FilmChoices(crf=1))
    with av.open(str(tmp_path / f"film{suffix}")) as film:
        for color, picture in zip(COLORS, film.decode(video=0), strict=True):
            r, g, b = np.array(color) / 255
            y = 0.2126 * r + 0.7152 * g + 0.0722 * b
            expected = 16 + 219 * y, 128 + 224 * (b - y) / 1.8556, 128 + 224 * (r - y) / 1.5748
            planes = picture.to_ndarray()[:72]  # 48 rows of Y, 12 of Cb, 12 of Cr, each of 64 numbers
            parts = planes[:48], planes[48:60], planes[60:]
            for part, value in zip(parts, expected, strict=True):
                assert np.abs(part - value).max() <= 1.0
            assert (picture.color_range, picture.colorspace) == (1, 1)
            assert (picture.color_primaries, picture.color_trc) == (1, 1)


def test_an_mp4_carries_its_tags_in_its_header_as_well(tmp_path):
    """The box colr (ISO 14496-12): nclx, then primaries, transfer and matrix of H.273, and the range."""
    for crf, expected in ((18, (1, 1, 1, 0)), (0, (1, 13, 0, 0x80))):
        content = written(tmp_path / "film.mp4", moving(2), FilmChoices(crf=crf)).read_bytes()
        place = content.index(b"colrnclx") + 8
        assert struct.unpack_from(">3HB", content, place) == expected


@pytest.mark.parametrize("suffix", VIDEOS)
@pytest.mark.parametrize("size", [(64, 48), (33, 17)])
def test_crf_0_is_bit_for_bit(tmp_path, suffix, size):
    rng = np.random.default_rng(5)
    frames = [rng.integers(0, 256, (size[1], size[0], 3), dtype=np.uint8) for _ in range(3)]
    path = written(tmp_path / f"film{suffix}", frames, FilmChoices(crf=0))
    assert np.array_equal(list(read_film(path)), frames)
    assert np.array_equal([pixels for _, pixels in by_ffmpeg(path)], frames)


@pytest.mark.parametrize("suffix", VIDEOS)
def test_lower_crf_is_better_and_larger(tmp_path, suffix):
    frames = moving(6)
    results = []
    for crf in (40, None, 4):
        path = written(tmp_path / f"film{suffix}", frames, FilmChoices(crf=crf))
        results.append((psnr(list(read_film(path)), frames), path.stat().st_size))
    (worst, smallest), (usual, middle), (best, largest) = results
    assert worst < usual < best
    assert smallest < middle < largest


@pytest.mark.parametrize("fps", [24, 12.5, 24000 / 1001, "30000/1001", 1 / 3, Fraction(1, 600), 1000])
def test_times_are_exact_in_mp4_and_to_half_a_millisecond_in_webm(tmp_path, fps):
    rate = FilmChoices(fps).rate
    expected = [k / rate for k in range(5)]
    path = written(tmp_path / "film.mp4", moving(5), FilmChoices(fps))
    assert [time for time, _ in by_ffmpeg(path)] == expected
    assert film_facts(path) == (5, (64, 48), rate, "h264")
    path = written(tmp_path / "film.webm", moving(5), FilmChoices(fps))
    times = [time for time, _ in by_ffmpeg(path)]
    assert all(abs(time - exact) <= Fraction(1, 2000) for time, exact in zip(times, expected, strict=True))
    frames, size, _, codec = film_facts(path)
    assert (frames, size, codec) == (5, (64, 48), "vp9")


@pytest.mark.parametrize(
    ("given", "rate"), [(24, 24), (24000 / 1001, Fraction(24000, 1001)), (1 / 3, Fraction(1, 3))]
)
def test_a_float_is_the_fraction_that_was_meant(given, rate):
    assert FilmChoices(given).rate == rate


def test_an_mp4_starts_with_its_index_and_has_no_date_or_library(tmp_path):
    content = written(tmp_path / "film.mp4", moving(), FilmChoices()).read_bytes()
    names = [name for name, _ in boxes(content)]
    assert names.index(b"moov") < names.index(b"mdat")
    version, created, changed = struct.unpack_from(">I2I", box(content, b"moov", b"mvhd"))
    assert (version, created, changed) == (0, 0, 0)
    assert b"Lav" not in content


def test_a_webm_has_no_date_and_no_version_of_a_library(tmp_path):
    content = written(tmp_path / "film.webm", moving(), FilmChoices()).read_bytes()
    assert b"\x44\x61" not in content[:400]  # DateUTC
    assert b"Lavf6" not in content
    assert b"Lavc" not in content


@pytest.mark.parametrize("suffix", VIDEOS)
@pytest.mark.parametrize("crf", [None, 0])
def test_the_same_frames_give_the_same_bytes_on_any_number_of_cores(tmp_path, suffix, crf):
    frames = moving(12)
    many = written(tmp_path / "first", frames, FilmChoices(crf=crf), suffix).read_bytes()
    assert written(tmp_path / "again", frames, FilmChoices(crf=crf), suffix).read_bytes() == many
    cores = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(cores)})
        one = written(tmp_path / "one", frames, FilmChoices(crf=crf), suffix).read_bytes()
    finally:
        os.sched_setaffinity(0, cores)
    assert one == many


@pytest.mark.parametrize("suffix", VIDEOS)
def test_even_one_pixel_can_be_a_film(tmp_path, suffix):
    frame = np.full((1, 1, 3), (200, 100, 50), np.uint8)
    (back,) = read_film(written(tmp_path / f"film{suffix}", [frame], FilmChoices(crf=1, pad=True)))
    assert back.shape == ((2, 2, 3) if suffix == ".mp4" else (1, 1, 3))
    assert np.abs(back.astype(int) - frame).max() <= 2


def test_padding_repeats_the_last_column_and_row(tmp_path):
    frames = [np.full((17, 33, 3), (200, 100, 50), np.uint8)] * 3
    path = written(tmp_path / "film.mp4", frames, FilmChoices(crf=1, pad=True))
    back = np.array(list(read_film(path)), int)
    assert back.shape == (3, 18, 34, 3)
    assert np.abs(back - (200, 100, 50)).max() <= 2
    assert film_facts(path).size == (34, 18)
    # where sides need not be even, nothing is added
    assert film_facts(written(tmp_path / "film.webm", frames, FilmChoices(pad=True))).size == (33, 17)
    assert film_facts(written(tmp_path / "film.mp4", frames, FilmChoices(crf=0, pad=True))).size == (33, 17)


def test_names_that_look_like_addresses_are_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path / "http:a%03d?b#.mp4", moving(2), FilmChoices())
    assert len(list(read_film(path))) == 2
    assert [one.name for one in tmp_path.iterdir()] == [path.name]
    relative = type(path)("pipe:1.webm")
    written(relative, moving(2), FilmChoices())
    assert len(list(read_film(relative))) == 2
