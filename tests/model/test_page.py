"""The page about model files: what it says in numbers and lists is what the code has."""

from __future__ import annotations

import inspect
import re

from PIL import Image

from firefly_sample import frame_camera, load_model
from firefly_sample.assets import asset_dir
from firefly_sample.model.framing import AZIMUTH, ELEVATION, FILL
from firefly_sample.model.gltf.extensions import IMPLEMENTED
from firefly_sample.plan.exposure import TARGET
from firefly_sample.scenes.model import scene
from tests.model import make_pictures

DOCS = asset_dir("models").parent / "docs"
PAGE = " ".join((DOCS / "models.md").read_text().split())


def number(pattern: str) -> float:
    (found,) = re.findall(pattern, PAGE)
    return float(found)


def test_extensions() -> None:
    assert set(re.findall(r"`((?:KHR|EXT)_\w+)`", PAGE)) == IMPLEMENTED


def test_the_limit_of_textures() -> None:
    limit = number(r"more than (\d+) megapixels is refused")
    assert limit == inspect.signature(load_model).parameters["max_texture_megapixels"].default
    assert limit == next(p.default for p in scene.parameters if p.name == "max_texture_megapixels")


def test_the_camera() -> None:
    assert number(r"(\d+) degrees to the right of the front") == AZIMUTH
    assert number(r"(\d+) degrees above the horizon\.") == ELEVATION
    assert number(r"(\d+) % of the picture's width or height") == 100 * FILL
    assert inspect.signature(frame_camera).parameters["fill"].default == FILL


def test_exposure_and_settings() -> None:
    assert number(r"becomes (\d+) % of the display's white") == 100 * TARGET
    arguments = ", ".join(f"{name}={value!r}" for name, value in scene.settings.items()).replace("'", '"')
    assert f"Settings({arguments})" in PAGE


def test_pictures() -> None:
    three, turning = DOCS / "images" / "three-models.jpg", DOCS / "images" / "turntable.webp"
    width, height = make_pictures.SIZE
    with Image.open(three) as picture:
        assert picture.size == (width * len(make_pictures.THREE), height)
    assert three.stat().st_size < 200_000
    with Image.open(turning) as picture:
        assert picture.size == make_pictures.TURNING_SIZE
        assert picture.n_frames == make_pictures.SECONDS * make_pictures.FPS
    assert turning.stat().st_size < 600_000
