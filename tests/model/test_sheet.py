"""The contact sheet's files: each is drawn, and shows what its label says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from firefly_sample import Renderer, Settings, load_model, model_scene
from firefly_sample.assets import asset_dir
from tests.conftest import make_renderer
from tests.model.make_sheet import SIZE, assemble, draw, write_files
from tests.model.sheet_files import FILES, TIMES


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return write_files(tmp_path_factory.mktemp("sheet"))


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with make_renderer(SIZE, Settings(exposure="auto")) as made:
        yield made


@pytest.fixture(scope="module")
def pictures(paths: dict[str, Path], renderer: Renderer) -> dict[str, np.ndarray]:
    return {label: draw(renderer, path, TIMES.get(label, 0.0)) for label, path in paths.items()}


@pytest.mark.parametrize("label", FILES)
def test_nothing_is_lost(paths: dict[str, Path], label: str) -> None:
    assert load_model(paths[label]).node().warnings == ()


@pytest.mark.parametrize("label", FILES)
def test_something_is_drawn(paths: dict[str, Path], renderer: Renderer, label: str) -> None:
    """Something opaque; in "blended" that is a ball."""
    frame = renderer.render(model_scene(paths[label], ground=False), outputs=("id",))
    assert (frame.id >= 0).mean() > 0.05


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("no normals: flat", "normals"),
        ("wrap: repeat", "wrap: mirror"),
        ("wrap: repeat", "wrap: clamp"),
        ("filter: nearest", "filter: linear"),
        ("mask, cut-off 0.2", "mask, cut-off 0.7"),
        ("animation at 0 s", "at 0.35 s"),
        ("at 0.35 s", "at 0.7 s"),
        ("point light", "spotlight"),
        ("spotlight", "directional light"),
        ("normal map", "occlusion map"),
        ("unlit", "JPEG"),
    ],
)
def test_pairs_differ(pictures: dict[str, np.ndarray], one: str, other: str) -> None:
    """What only one property tells apart is not drawn alike."""
    difference = np.abs(pictures[one].astype(int) - pictures[other]).max(axis=2)
    assert (difference > 16).mean() > 0.01


def test_quantised_and_interleaved_are_one_ring(paths: dict[str, Path], renderer: Renderer) -> None:
    shapes = [
        renderer.render(model_scene(paths[label], ground=False), outputs=("id",)).id >= 0
        for label in ("quantised", "interleaved")
    ]
    assert (shapes[0] != shapes[1]).mean() < 2e-3


def test_a_higher_cut_off_leaves_less(paths: dict[str, Path], renderer: Renderer) -> None:
    wide, narrow = (
        renderer.render(model_scene(paths[f"mask, cut-off {value}"], ground=False), outputs=("id",)).id >= 0
        for value in (0.2, 0.7)
    )
    assert not (narrow & ~wide).any()
    assert wide.sum() > 1.5 * narrow.sum()


def test_the_sheet_of_the_documentation_has_this_size(pictures: dict[str, np.ndarray]) -> None:
    page = asset_dir("models").parent / "docs" / "images" / "models.jpg"
    with Image.open(page) as kept:
        assert kept.size == assemble(pictures).size
    assert page.stat().st_size < 250_000


@pytest.mark.parametrize("name", ["bonsai", "lantern", "orrery"])
def test_models_to_look_at_lose_nothing(name: str) -> None:
    assert load_model(asset_dir("models") / f"{name}.glb").node().warnings == ()
