"""Films of frames that the renderer draws: how much they lose of a dark picture."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.encoding.films import FILMS, FilmChoices, read_film
from firefly_sample.scenes import build_scene, find_scene
from tests.conftest import borrow_renderer
from tests.encoding.moving import psnr, written

SKY = np.s_[:, :14]
"""The rows of one dark colour above the horizon."""


@pytest.fixture(scope="module")
def frames():
    scene = build_scene(find_scene("spheres"), lights=16)
    with borrow_renderer((96, 72)) as renderer:
        drawn = np.array([renderer.render(scene, k / 24, ("color",)).color for k in range(3)])
    assert len(np.unique(drawn[SKY].reshape(-1, 3), axis=0)) == 1
    return drawn


def luma(images):
    return np.asarray(images, float) @ (0.2126, 0.7152, 0.0722)


@pytest.mark.parametrize("suffix", [".mp4", ".webm", ".webp", ".apng"])
def test_what_is_exact_keeps_every_bit(tmp_path, frames, suffix):
    choices = FilmChoices(crf=0 if FILMS[suffix].largest_crf else None)
    assert FILMS[suffix].is_exact(choices)
    assert np.array_equal(list(read_film(written(tmp_path / f"film{suffix}", list(frames), choices))), frames)


@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_the_default_quality_loses_little(tmp_path, frames, suffix):
    """A quantiser's step of 2^((26 - 4) / 6) = 12.7 codes of Y, that of H.264 eight above 18.

    Errors that are even within a step are 12.7 / sqrt(12) * 255 / 219 = 4.27 codes, 35.5 dB. Chroma of a
    quarter of the pixels loses more; its mean is the same, and no colour is shifted by half a code.
    """
    back = np.array(list(read_film(written(tmp_path / f"film{suffix}", list(frames), FilmChoices()))))
    assert psnr(luma(back), luma(frames)) > 35.5
    assert np.abs((back - frames.astype(float)).mean(axis=(0, 1, 2))).max() < 0.5
    # no bands and no blocks: half a code of Y, of Cb and of what is rounded
    assert np.abs(back[SKY].astype(int) - frames[SKY]).max() <= 2


def test_a_gif_is_off_by_less_than_a_cell_of_its_octree(tmp_path, frames):
    """Cells are 16 codes wide, in which even errors have a mean of 4."""
    back = np.array(list(read_film(written(tmp_path / "film.gif", list(frames), FilmChoices()))), int)
    assert np.abs(back - frames).mean() < 4
    # dithered around its colour; Pillow passes on whole codes only, so that less than one may stay
    assert np.abs((back - frames)[SKY].mean(axis=(0, 1, 2))).max() < 1
