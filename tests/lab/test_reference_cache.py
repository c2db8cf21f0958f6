"""References that are kept: found again if and only if nothing has changed."""

import os
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

import firefly_sample.lab.reference.cache as module
from firefly_sample.errors import SettingsError
from firefly_sample.lab.reference.cache import cache_folder, reference_frame
from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.scenes import ball_scene, wall


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


def _depth_offset(scene):
    scene.root.find("floor").set_depth_offset(1)


CHANGES = {
    "light": _light,
    "vertex": _vertex,
    "exposure": _exposure,
    "camera": _camera,
    "depth offset": _depth_offset,
}


@pytest.mark.parametrize("change", list(CHANGES))
def test_the_smallest_change_misses(renderer, computed, tmp_path, change):
    scene = ball_scene(5)
    reference_frame(renderer, scene, folder=tmp_path)
    CHANGES[change](scene)
    reference_frame(renderer, scene, folder=tmp_path)
    reference_frame(renderer, scene, Settings(specular_model="blinn_phong"), folder=tmp_path)
    assert len(computed) == 3
    reference_frame(renderer, scene, folder=tmp_path)
    assert len(computed) == 3


def test_alpha_of_vertices_counts_where_it_changes_no_pixel(renderer, computed, tmp_path):
    """It may change a shadow."""
    scene = ball_scene(5)
    geom = scene.root.find("floor").node().geoms[0][0]
    for alpha in (0.5, 0.5000000001):
        geom.set_colors(np.tile([1.0, 1.0, 1.0, alpha], (len(geom.vertices), 1)))
        reference_frame(renderer, scene, folder=tmp_path)
    assert len(computed) == 2


PIXELS = np.full((2, 2, 4), 255, dtype=np.uint8)
BLUE = np.array([0, 0, 1, 0], dtype=np.uint8)
TANGENTS = {"tangents": np.tile([1.0, 0.0, 0.0, 1.0], (4, 1))}
NEW_STATE = {  # pairs of floors that look alike to a renderer of this picture, or may
    "base texture's wrap": lambda one: (
        {"texture": Texture(PIXELS, wrap_u="clamp" if one else "mirror")},
        {},
    ),
    "base texture's filter": lambda one: (
        {"texture": Texture(PIXELS, magfilter="nearest" if one else "linear")},
        {},
    ),
    "emission texture": lambda one: ({"emission_texture": Texture(PIXELS if one else PIXELS // 2)}, {}),
    "emission texture or none": lambda one: ({"emission_texture": Texture(PIXELS) if one else None}, {}),
    "emission texture's sampling": lambda one: (
        {"emission_texture": Texture(PIXELS, minfilter="nearest" if one else "linear")},
        {},
    ),
    "metallic": lambda one: ({"metallic": 0.5 if one else 0.5000000001}, {}),
    "metallic or not": lambda one: ({"metallic": 0.0 if one else None}, {}),
    "roughness": lambda one: ({"metallic": 0.5, "roughness": 0.3 if one else 0.3000000001}, {}),
    "metallic-roughness texture": lambda one: (
        {"metallic": 0.5, "metallic_roughness_texture": Texture(PIXELS if one else PIXELS // 2)},
        {},
    ),
    "normal texture": lambda one: ({"normal_texture": Texture(PIXELS - BLUE if one else PIXELS)}, TANGENTS),
    "normal texture or occlusion texture": lambda one: (
        {"normal_texture" if one else "occlusion_texture": Texture(PIXELS)},
        TANGENTS,
    ),
    "normal scale": lambda one: (
        {"normal_texture": Texture(PIXELS), "normal_scale": 0.5 if one else 0.5000000001},
        TANGENTS,
    ),
    "tangents": lambda one: (
        {"normal_texture": Texture(PIXELS)},
        {"tangents": np.tile([1.0, 0.0, 0.0, 1.0 if one else -1.0], (4, 1))},
    ),
    "occlusion texture": lambda one: ({"occlusion_texture": Texture(PIXELS if one else PIXELS // 2)}, {}),
    "modulating texture": lambda one: ({"modulate_texture": Texture(PIXELS if one else PIXELS // 2)}, {}),
    "occlusion strength": lambda one: (
        {"occlusion_texture": Texture(PIXELS), "occlusion_strength": 0.5 if one else 0.5000000001},
        {},
    ),
    "unlit": lambda one: ({"unlit": one}, {}),
    "set": lambda one: ({"emission_texture": Texture(PIXELS), "emission_texcoord": int(one)}, {}),
    "second texture coordinates": lambda one: (
        {"emission_texture": Texture(PIXELS), "emission_texcoord": 1},
        {"texcoords_1": np.full((4, 2), 0.5 if one else 0.5000000001)},
    ),
}


@pytest.mark.parametrize("make", NEW_STATE.values(), ids=NEW_STATE)
def test_textures_and_their_sampling_count(renderer, computed, tmp_path, make):
    """Also where all of an image is white, so that no pixel changes."""
    plain = wall(40.0)
    for one in (True, True, False, False):
        material, arrays = make(one)
        geom = Geom(
            plain.vertices,
            plain.triangles,
            plain.normals,
            plain.texcoords,
            texcoords_1=arrays.get("texcoords_1", plain.texcoords),
            tangents=arrays.get("tangents"),
        )
        scene = ball_scene(5)
        looks = Material("floor", emission=(1, 1, 1), **material)
        scene.root.find("floor").node().geoms[:] = [(geom, looks)]
        reference_frame(renderer, scene, folder=tmp_path)
    assert len(computed) == 2


def _with_arrays(path, **changes):
    """The same file with other arrays in it, whole as `np.savez` writes it."""
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    np.savez(path, **{name: array for name, array in (arrays | changes).items() if array is not None})


def _array_alone(path):
    with path.open("wb") as file:
        np.save(file, np.zeros((36, 48, 3)))


def _packed(path):
    """A member that says it is compressed and is not."""
    content = path.read_bytes()
    with zipfile.ZipFile(path, "w") as file:
        for name in ("key", "radiance", "light", "position"):
            file.writestr(f"{name}.npy", content[:100])
    content = bytearray(path.read_bytes())
    method = content.find(b"PK\x01\x02") + 10  # of the first member, in the list at the end
    content[method] = zipfile.ZIP_DEFLATED
    path.write_bytes(content)


def _middle_bit(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 255
    path.write_bytes(content)


IMAGE = np.zeros((36, 48, 3))
DAMAGE = {
    "empty": lambda path: path.write_bytes(b""),
    "cut": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "another byte": _middle_bit,
    "an array alone": _array_alone,
    "no array": lambda path: path.write_bytes(pickle.dumps({"radiance": IMAGE})),
    "packed": _packed,
    "text": lambda path: path.write_text("radiance"),
    "another key": lambda path: _with_arrays(path, key=np.array("0" * 40)),
    "no key": lambda path: _with_arrays(path, key=None),
    "without light": lambda path: _with_arrays(path, light=None),
    "float32": lambda path: _with_arrays(path, light=IMAGE.astype(np.float32)),
    "complex": lambda path: _with_arrays(path, light=IMAGE.astype(complex)),
    "objects": lambda path: _with_arrays(path, light=np.full((36, 48, 3), None)),
    "another size": lambda path: _with_arrays(path, light=IMAGE[1:]),
    "two channels": lambda path: _with_arrays(path, light=IMAGE[..., :2]),
    "a number": lambda path: _with_arrays(path, light=np.array(1.0)),
}


def test_whatever_else_is_in_a_file_counts_as_missing(renderer, computed, tmp_path):
    scene = ball_scene(5)
    first = reference_frame(renderer, scene, folder=tmp_path)
    (path,) = tmp_path.iterdir()
    content = path.read_bytes()
    key = path.stem.removeprefix("reference-")
    assert module._load(tmp_path, key, (36, 48)) is not None
    for name, damage in DAMAGE.items():
        damage(path)
        assert module._load(tmp_path, key, (36, 48)) is None, name
        path.write_bytes(content)
    path.unlink()
    os.mkfifo(path)  # not waited for
    again = reference_frame(renderer, scene, folder=tmp_path)
    assert len(computed) == 2
    assert same(first, again)
    with np.load(path) as stored:
        assert str(stored["key"]) == key


def test_nothing_is_deleted_but_references(renderer, tmp_path, monkeypatch):
    """The folder is one that a caller gave, with files of others in it."""
    others = {"mine.npz", f"{'0' * 40}.npz", ".x.tmp", "reference-notes.npz"}
    for name in others:
        (tmp_path / name).write_text("")
        os.utime(tmp_path / name, (0, 0))
    (tmp_path / f"reference-{'0' * 40}.npz").write_text("")
    monkeypatch.setattr(module, "LARGEST_CACHE", 1)
    reference_frame(renderer, ball_scene(3), folder=tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names > others
    assert len(names) == len(others) + 1


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


def test_without_a_home_references_are_computed(renderer, computed, monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # does not count
    monkeypatch.setattr(Path, "home", homeless)
    assert cache_folder() is None
    reference_frame(renderer, ball_scene(3))
    assert len(computed) == 1
    assert not Path("relative").exists()


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
