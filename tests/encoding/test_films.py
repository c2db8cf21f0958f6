"""What films refuse, and how they say it."""

from __future__ import annotations

import builtins
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.encoding.films import (
    FILMS,
    FilmChoices,
    check_film,
    film_facts,
    read_film,
    write_film,
)
from firefly_sample.errors import FireflyError, MissingPackageError, OutputError
from firefly_sample.frame import OUTPUTS
from tests.encoding.moving import moving, written


def test_every_film_takes_color_and_the_fast_rates_that_it_names():
    for suffix, film in FILMS.items():
        assert suffix == film.suffix
        check_film(suffix, "color", (64, 48), 1, FilmChoices(film.fastest))
        with pytest.raises(OutputError, match=f"fps must be at most {film.fastest} for {suffix} "):
            check_film(suffix, "color", (64, 48), 1, FilmChoices(film.fastest + 1))


def test_outputs_are_taken_by_their_channels():
    def refusal(suffix, output):
        try:
            check_film(suffix, output, (64, 48), 2, FilmChoices())
        except OutputError as error:
            return str(error)
        return None

    refusals = {suffix: {output: refusal(suffix, output) for output in OUTPUTS} for suffix in FILMS}
    taken = {
        suffix: {output for output, text in said.items() if text is None} for suffix, said in refusals.items()
    }
    three = {"color", "volumes", "wireframe"}
    four = three | {"color_alpha"}
    assert taken == {".mp4": three, ".webm": three, ".webp": four, ".apng": four, ".gif": three}
    for suffix, said in refusals.items():
        assert all(
            suffix in text and repr(output) in text for output, text in said.items() if text is not None
        )


@pytest.mark.parametrize(
    ("suffix", "output", "size", "choices", "message"),
    [
        (
            ".mp5",
            "color",
            (64, 48),
            {},
            r"no film format '.mp5' \(did you mean '.mp4'\?\): choose from .mp4, .web",
        ),
        (".mp4", "colour", (64, 48), {}, r"no output 'colour' \(did you mean 'color'\?\)"),
        (".mp4", "depth", (64, 48), {}, "a .mp4 shows 8-bit pictures and cannot hold the output 'depth'"),
        (
            ".mp4",
            "color_alpha",
            (64, 48),
            {},
            "a .mp4 has no alpha .*'color_alpha': .webp and .apng have alpha",
        ),
        (".gif", "color_alpha", (64, 48), {}, "a .gif has one bit of alpha .*: .webp and .apng have alpha"),
        (".mp4", "color", (33, 48), {}, "not 33x48: choose one of the sizes 32x48 and 34x48, or --pad"),
        (".mp4", "color", (33, 17), {}, "not 33x17: choose one of the sizes 32x16 and 34x18, or --pad"),
        (".mp4", "color", (1, 48), {}, "not 1x48: choose the size 2x48, or --pad"),
        (".mp4", "color", (16386, 48), {}, "a .mp4 has at most 16384 pixels a side, not 16386x48"),
        (".webp", "color", (16384, 48), {}, "a .webp has at most 16383 pixels a side"),
        (".gif", "color", (65536, 48), {}, "a .gif has at most 65535 pixels a side"),
        (".gif", "color", (0, 48), {}, "size must be two whole numbers"),
        (".mp4", "color", (64, 48), {"crf": 52}, "crf must be a whole number from 0 to 51 for .mp4, got 52"),
        (
            ".webm",
            "color",
            (64, 48),
            {"crf": -1},
            "crf must be a whole number from 0 to 63 for .webm, got -1",
        ),
        (".webm", "color", (64, 48), {"crf": True}, "crf must be a whole number"),
        (".webp", "color", (64, 48), {"crf": 18}, "crf is for .mp4 and .webm, not for .webp: leave it out"),
        (
            ".webp",
            "color",
            (64, 48),
            {"quality": 0},
            "quality must be a whole number from 1 to 100 for .webp, got 0",
        ),
        (".apng", "color", (64, 48), {"quality": 90}, "quality is for .webp, not for .apng: leave it out"),
        (
            ".gif",
            "color",
            (64, 48),
            {"fps": 60},
            "fps must be at most 50 for .gif .*less than two hundredths",
        ),
        (".mp4", "color", (64, 48), {"fps": 0.001}, "fps must be at least 1/600, got 0.001"),
        *(
            (
                ".mp4",
                "color",
                (64, 48),
                {"fps": fps},
                f"fps must be a number above 0, or a fraction .*got {fps!r}",
            )
            for fps in (0, -24.0, float("nan"), float("inf"), "fast", "1/0")
        ),
    ],
)
def test_a_refusal_names_what_does_not_fit_and_the_way_out(suffix, output, size, choices, message):
    with pytest.raises(OutputError, match=message):
        check_film(suffix, output, size, 2, FilmChoices(**choices))


def test_a_film_without_frames_is_refused(tmp_path):
    for suffix in FILMS:
        with pytest.raises(OutputError, match=f"a {suffix} needs at least one frame, got 0"):
            check_film(suffix, "color", (64, 48), 0, FilmChoices())
        with pytest.raises(OutputError, match=f"a {suffix} needs at least one frame, got 0"):
            write_film(tmp_path / "film", suffix, [], (64, 48), FilmChoices())


@pytest.mark.parametrize("suffix", FILMS)
def test_a_frame_of_another_shape_is_refused_by_its_number(tmp_path, suffix):
    frames = moving(3)
    for wrong in (
        frames[2][:40],
        frames[2][..., :1],
        frames[2].astype(float),
        np.dstack([frames[2], frames[2][..., 0]]),
    ):
        with pytest.raises(OutputError, match=f"frame 2 of a {suffix} must be uint8 of shape "):
            write_film(tmp_path / "film", suffix, [*frames[:2], wrong], (64, 48), FilmChoices())


@pytest.mark.parametrize("suffix", FILMS)
def test_an_error_of_the_frames_is_not_hidden(tmp_path, suffix):
    def frames():
        yield from moving(2)
        raise FireflyError("no third one")

    with pytest.raises(FireflyError, match="no third one"):
        write_film(tmp_path / "film", suffix, frames(), (64, 48), FilmChoices())


@pytest.mark.parametrize("suffix", FILMS)
def test_progress_counts_the_frames(tmp_path, suffix):
    seen = []
    assert write_film(tmp_path / "film", suffix, moving(3), (64, 48), FilmChoices(), seen.append) == 3
    assert seen == [1, 2, 3]


@pytest.mark.parametrize("suffix", FILMS)
def test_a_full_disk_is_an_error_of_the_system(suffix):
    with pytest.raises(OSError, match="No space left"), Path("/dev/full").open("wb") as full:
        write_film(full, suffix, moving(20), (64, 48), FilmChoices())


@pytest.mark.parametrize("suffix", FILMS)
def test_a_damaged_film_is_an_error_that_names_it(tmp_path, suffix):
    path = written(tmp_path / f"film{suffix}", moving(9), FilmChoices())
    content = path.read_bytes()
    for damaged in (b"", b"not a film", content[: len(content) // 2]):
        path.write_bytes(damaged)
        with pytest.raises(FireflyError, match=f"cannot read .*film{suffix} as {suffix}: "):
            list(read_film(path))
    path.unlink()
    with pytest.raises(FireflyError, match=r"cannot read .*No such file"):
        list(read_film(path))
    with pytest.raises(FireflyError, match=r"cannot read .*No such file"):
        film_facts(path)


@pytest.mark.parametrize("suffix", FILMS)
def test_exact_films_are_those_whose_frames_come_back(tmp_path, suffix):
    frames = moving(3)
    film = FILMS[suffix]
    for given in ({}, {"crf": 0}, {"crf": 30}, {"quality": 80}):
        if ("crf" in given and not film.largest_crf) or ("quality" in given and not film.has_quality):
            continue
        choices = FilmChoices(**given)
        same = np.array_equal(list(read_film(written(tmp_path / f"film{suffix}", frames, choices))), frames)
        assert same == film.is_exact(choices), (suffix, given)


def test_without_pyav_pillow_still_writes_films(tmp_path, monkeypatch):
    real = builtins.__import__

    def without_av(name, *arguments, **options):
        if name.split(".")[0] == "av":
            raise ImportError("No module named 'av'")
        return real(name, *arguments, **options)

    path = written(tmp_path / "film.mp4", moving(2), FilmChoices())
    monkeypatch.setattr(builtins, "__import__", without_av)
    message = r"a .mp4 needs the package av \(.*\): run .* install .*, or choose .webp, .apng, .gif"
    for use in (
        lambda: check_film(".mp4", "color", (64, 48), 2, FilmChoices()),
        lambda: write_film(tmp_path / "new", ".mp4", moving(2), (64, 48), FilmChoices()),
        lambda: list(read_film(path)),
    ):
        with pytest.raises(MissingPackageError, match=message):
            use()
    for suffix in (".webp", ".apng", ".gif"):
        check_film(suffix, "color", (64, 48), 2, FilmChoices())
        assert len(list(read_film(written(tmp_path / f"film{suffix}", moving(2), FilmChoices())))) == 2


def test_choices_are_kept_in_a_manifest_without_rounding():
    assert FilmChoices(24000 / 1001, crf=0, pad=True).as_json() == {
        "fps": "24000/1001",
        "crf": 0,
        "quality": None,
        "pad": True,
    }
