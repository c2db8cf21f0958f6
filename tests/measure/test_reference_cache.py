"""References that are kept: found again if and only if nothing has changed."""

import os

import numpy as np
import pytest

import firefly_sample.measure.reference_cache as module
from firefly_sample.errors import SettingsError
from firefly_sample.measure.reference_cache import cache_folder, reference_frame
from firefly_sample.reference.frame import render_reference
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.scenes import ball_scene


@pytest.fixture
def computed(monkeypatch):
    """How many references were computed."""
    calls = []

    def counted(*given, **options):
        calls.append(given)
        return render_reference(*given, **options)

    monkeypatch.setattr(module, "render_reference", counted)
    return calls


@pytest.fixture
def renderer():
    with make_renderer((48, 36)) as made:
        yield made


def same(one, other):
    return all(
        getattr(one, name).tobytes() == getattr(other, name).tobytes()
        for name in ("radiance", "light", "display", "color", "position")
    )


def test_the_same_frame_is_found_again_also_of_another_scene(renderer, computed, tmp_path):
    first = reference_frame(renderer, ball_scene(5), folder=tmp_path)
    again = reference_frame(renderer, ball_scene(5), folder=tmp_path)
    assert len(computed) == 1
    assert same(first, again)
    assert [path.suffix for path in tmp_path.iterdir()] == [".npz"]


def _light(scene):
    node = scene.root.find("lights").node()
    arrays = node.arrays
    node.set_arrays(arrays.positions, arrays.colors * (1 + 1e-15), arrays.radii)


def _vertex(scene):
    geom = scene.root.find("floor").node().geoms[0][0]
    moved = geom.vertices.copy()
    moved[0, 0] += 1e-12
    geom.set_vertices(moved)


def _exposure(scene):
    scene.exposure = 2.0


def _camera(scene):
    scene.camera.set_pos(0, -4, 3.0000000001)


CHANGES = {"light": _light, "vertex": _vertex, "exposure": _exposure, "camera": _camera}


@pytest.mark.parametrize("change", list(CHANGES))
def test_the_smallest_change_misses(renderer, computed, tmp_path, change):
    scene = ball_scene(5)
    reference_frame(renderer, scene, folder=tmp_path)
    CHANGES[change](scene)
    reference_frame(renderer, scene, folder=tmp_path)
    reference_frame(renderer, scene, Settings(specular="blinn_phong"), folder=tmp_path)
    assert len(computed) == 3
    reference_frame(renderer, scene, folder=tmp_path)
    assert len(computed) == 3


@pytest.mark.parametrize("damage", ["empty", "cut", "other bytes", "other arrays"])
def test_a_damaged_file_is_computed_again(renderer, computed, tmp_path, damage):
    scene = ball_scene(5)
    first = reference_frame(renderer, scene, folder=tmp_path)
    (path,) = tmp_path.iterdir()
    content = path.read_bytes()
    if damage == "other arrays":
        np.savez(path, radiance=np.zeros(3), light=np.zeros(3), position=np.zeros(3))
    else:
        middle = bytearray(content)
        middle[len(content) // 2] ^= 255
        damaged = {"empty": b"", "cut": content[: len(content) // 2], "other bytes": bytes(middle)}
        path.write_bytes(damaged[damage])
    again = reference_frame(renderer, scene, folder=tmp_path)
    assert len(computed) == 2
    assert same(first, again)
    assert path.read_bytes() == content


def test_a_folder_that_cannot_be_written_costs_time_alone(renderer, computed, tmp_path):
    (tmp_path / "file").write_text("")
    for _ in range(2):
        reference_frame(renderer, ball_scene(5), folder=tmp_path / "file" / "folder")
    assert len(computed) == 2


def test_the_renderers_settings_stay_and_progress_is_told(renderer, tmp_path):
    before, calls = renderer.settings, []
    reference_frame(
        renderer, ball_scene(5), Settings(tone="none"), 0.0, lambda *told: calls.append(told), folder=tmp_path
    )
    assert renderer.settings is before
    assert calls[-1] == (len(calls), len(calls))
    with pytest.raises(SettingsError, match="classic"):
        reference_frame(renderer, ball_scene(5), Settings(look="classic"), folder=tmp_path)
    assert renderer.settings is before


def test_an_empty_scene_has_a_reference(renderer, tmp_path):
    frame = reference_frame(renderer, Scene(background=(0.5, 0.25, 0.125)), folder=tmp_path)
    assert (frame.radiance == (0.5, 0.25, 0.125)).all()


def test_the_folder_is_the_users_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "firefly_sample" / "reference"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder() == tmp_path / ".cache" / "firefly_sample" / "reference"


def test_what_was_used_least_lately_goes_when_there_is_too_much(renderer, computed, tmp_path, monkeypatch):
    def ages():
        """Make every file a day older, so that the next one that is used is the newest."""
        for path in tmp_path.glob("*.npz"):
            stat = path.stat()
            os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns - 86_400 * 10**9))

    scenes = [ball_scene(count) for count in (3, 4, 5, 6)]
    for scene in scenes[:3]:
        ages()
        reference_frame(renderer, scene, folder=tmp_path)
    ages()
    reference_frame(renderer, scenes[0], folder=tmp_path)  # used again: the second is the oldest now
    size = max(path.stat().st_size for path in tmp_path.glob("*.npz"))
    monkeypatch.setattr(module, "LARGEST_CACHE", int(3.5 * size))
    ages()
    reference_frame(renderer, scenes[3], folder=tmp_path)
    assert len(computed) == 4
    assert len(list(tmp_path.glob("*.npz"))) == 3
    for scene in (scenes[3], scenes[0], scenes[2]):
        reference_frame(renderer, scene, folder=tmp_path)
    assert len(computed) == 4
    reference_frame(renderer, scenes[1], folder=tmp_path)
    assert len(computed) == 5


def test_a_frame_larger_than_all_that_is_kept_is_kept_itself(renderer, computed, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "LARGEST_CACHE", 1)
    for _ in range(2):
        reference_frame(renderer, ball_scene(3), folder=tmp_path)
    assert len(computed) == 1
