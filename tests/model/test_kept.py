"""Models and the levels of their textures, kept: the same as those that are made."""

import json
from copy import deepcopy
from dataclasses import fields

import numpy as np
import pytest

import firefly_sample.disk_cache as disk_cache
import firefly_sample.mipmaps as mipmaps
import firefly_sample.model.load as load
from firefly_sample.assets import model_path
from firefly_sample.disk_cache import VARIABLE
from firefly_sample.errors import ModelError
from firefly_sample.mipmaps import kept_texture_levels, mip_chain, texture_levels
from firefly_sample.model.data import MaterialData, ModelData
from firefly_sample.model.kept import load_kept
from firefly_sample.model.load import load_model
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.texture import Texture
from firefly_sample.srgb import srgb_to_linear
from tests.unit.test_disk_cache import write_kept

MODELS = ("bulb", "grass", "cat", "rocks")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    return tmp_path / "kept"


@pytest.fixture
def calls(monkeypatch):
    """How often a file was parsed, and levels were made."""
    made = {"parse": 0, "levels": 0}

    def counted(name, function):
        def run(*given):
            made[name] += 1
            return function(*given)

        return run

    monkeypatch.setattr(load, "read_gltf", counted("parse", load.read_gltf))
    monkeypatch.setattr(mipmaps, "texture_levels", counted("levels", mipmaps.texture_levels))
    return made


def nodes(root):
    return [path.node() for path in [root, *root.find_all_matches("**")]]


def textures(root):
    return [
        material.texture
        for node in nodes(root)
        if isinstance(node, GeomNode)
        for _, material in node.geoms
        if material.texture is not None
    ]


def described(root):
    """All that a tree says, and what in it is shared."""
    order, said = {}, []
    for path in [root, *root.find_all_matches("**")]:
        node = path.node()
        said.append((type(node).__name__, path.get_name(), np.asarray(path.get_mat(root)).tobytes()))
        for geom, material in getattr(node, "geoms", ()):
            shared = [order.setdefault(id(thing), len(order)) for thing in (geom, material, material.texture)]
            arrays = (geom.vertices, geom.triangles, geom.normals, geom.texcoords, geom.colors)
            bits = [None if array is None else (array.dtype.str, array.tobytes()) for array in arrays]
            texture = material.texture
            image = None if texture is None else (texture.name, texture.size, texture.pixels.tobytes())
            rest = {k: repr(v) for k, v in vars(material).items() if k != "texture"}
            said.append((geom.name, shared, bits, rest, image))
    return said


@pytest.mark.parametrize("name", MODELS)
def test_a_kept_model_is_the_same_and_is_not_parsed(folder, calls, monkeypatch, name):
    path = model_path(f"{name}.glb")
    made, kept = load_model(path), load_model(path)
    assert calls["parse"] == 1
    assert not textures(kept) or [t.digest for t in textures(kept)] == [t.digest for t in textures(made)]
    monkeypatch.setenv(VARIABLE, "off")
    plain = load_model(path)
    assert calls["parse"] == 2
    assert described(plain) == described(made) == described(kept)
    assert calls["parse"] == 2 + bool(textures(kept))  # once more, for all pixels


def test_another_name_or_another_byte_is_another_model(folder, calls, tmp_path):
    content = model_path("bulb.glb").read_bytes()
    for name, data in (("a", content), ("b", content), ("a", content + b" "), ("a", content)):
        (tmp_path / f"{name}.glb").write_bytes(data)
        assert load_model(tmp_path / f"{name}.glb").get_name() == name
    assert calls["parse"] == 3


def test_pixels_come_from_the_file_as_it_was_loaded(folder, tmp_path):
    path = tmp_path / "cat.glb"
    path.write_bytes(model_path("cat.glb").read_bytes())
    expected = [texture.pixels for texture in textures(load_model(path))]
    kept = textures(load_model(path))
    path.unlink()
    for texture, pixels in zip(kept, expected, strict=True):
        np.testing.assert_array_equal(texture.pixels, pixels)
        assert not texture.pixels.flags.writeable
        assert texture.revision == 1


def test_a_damaged_model_is_not_kept(folder, tmp_path):
    (tmp_path / "broken.glb").write_bytes(model_path("bulb.glb").read_bytes()[:-9])
    for _ in range(2):
        with pytest.raises(ModelError, match="truncated"):
            load_model(tmp_path / "broken.glb")
    assert not folder.exists()


@pytest.mark.parametrize("content", [b"", b"firefly_sample derived 1\n", None])
def test_what_is_kept_under_a_models_name_may_be_anything(folder, calls, content):
    path = model_path("grass.glb")
    before = described(load_model(path))
    for file in folder.iterdir():
        if content is None:
            from firefly_sample.disk_cache import save_derived

            save_derived(file.stem, {"name": "another"}, {"0": np.zeros(3)})
        else:
            file.write_bytes(content)
    assert described(load_model(path)) == before
    assert calls["parse"] == 2


def fail():
    raise AssertionError("nothing is parsed")


MODEL = [field.name for field in fields(ModelData)]
MATERIAL = [field.name for field in fields(MaterialData)]
OPTIONAL = {
    ("about", "model", MODEL.index("materials"), 0, MATERIAL.index(name)) for name in ("texture", "metallic")
}
"""What may also be None: the material of a bulb need have neither its texture nor a metal's share."""


def wrong_insides(header):
    """Copies of a JSON value, in each of which one part has another type, is out of range, or is missing."""

    def parts(value, path=()):
        yield path, value
        if isinstance(value, dict | list):
            for key in value if isinstance(value, dict) else range(len(value)):
                yield from parts(value[key], (*path, key))

    for path, value in list(parts(header)):
        wrong = [None, "?", [], {}, [1, 2], 0.25, True, -2, 10**9]
        wrong = [other for other in wrong if type(other) is not type(value) or type(value) is int]
        if value == []:
            wrong.remove({})  # as empty
        if path in OPTIONAL:
            wrong.remove(None)
        for other in wrong:
            copy = deepcopy(header)
            if not path:
                yield other
                continue
            inner = copy
            for key in path[:-1]:
                inner = inner[key]
            inner[path[-1]] = other
            yield copy
        if isinstance(value, dict):
            for key in value:
                copy = deepcopy(header)
                inner = copy
                for step in path:
                    inner = inner[step]
                del inner[key]
                yield copy


def test_a_model_with_a_right_checksum_and_a_wrong_inside_counts_as_missing(folder):
    """The header of a kept model is changed in every place, and the checksum is made to fit."""
    load_model(model_path("bulb.glb"))
    (path,) = (path for path in folder.iterdir() if path.name.startswith("model-"))
    content = path.read_bytes()
    start = len(disk_cache._MAGIC) + disk_cache._FRAME.size
    size, _ = disk_cache._FRAME.unpack(content[len(disk_cache._MAGIC) : start])
    text = content[start : start + size]
    write_kept(path, text, content[start + size :])
    assert load_kept(path.stem, fail) is not None
    tried = 0
    for header in wrong_insides(json.loads(text)):
        changed = json.dumps(header).encode()
        # spaces after the JSON, so that the arrays stay at multiples of 64 bytes
        longer = max(0, -(-(len(changed) - size) // 64) * 64)
        changed = changed.ljust(size + longer)
        write_kept(path, changed, content[start + size :])
        assert load_kept(path.stem, fail) is None, header
        tried += 1
    assert tried > 100


@pytest.mark.parametrize("cutoff", [None, 0.5, 0.3])
@pytest.mark.parametrize("stored", [False, True])
def test_levels_are_kept_by_pixels_cutoff_and_look(folder, calls, cutoff, stored):
    (texture,) = set(textures(load_model(model_path("grass.glb"))))
    for given in ((cutoff, stored), (0.7, stored), (cutoff, not stored)) * 2:
        found, expected = kept_texture_levels(texture, *given), texture_levels(texture.pixels, *given)
        assert [level.tobytes() for level in found] == [level.tobytes() for level in expected]
        assert [level.shape for level in found] == [level.shape for level in expected]
    assert calls["levels"] == 3


def test_an_image_of_the_users_own_is_not_kept(folder, calls):
    (loaded,) = set(textures(load_model(model_path("grass.glb"))))
    before = sorted(folder.iterdir())
    loaded.set_pixels(loaded.pixels[::-1])
    for texture in (loaded, Texture(np.full((4, 8, 4), 200, np.uint8))):
        assert texture.digest is None
        kept_texture_levels(texture, None)
    assert calls["levels"] == 2
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 3), (16, 16), (33, 64)])
@pytest.mark.parametrize("cutoff", [None, 0.5])
@pytest.mark.parametrize("stored", [False, True])
def test_levels_are_those_of_the_plain_formula(shape, cutoff, stored):
    pixels = np.random.default_rng(3).integers(0, 256, (*shape, 4), dtype=np.uint8)
    values = pixels[::-1].astype(np.float32) / np.float32(255.0)
    if not stored:
        values[..., :3] = srgb_to_linear(pixels[::-1, :, :3] / 255.0).astype(np.float32)
    expected = [
        np.round(level * np.float32(65535.0)).astype(np.uint16) for level in mip_chain(values, cutoff)
    ]
    found = texture_levels(pixels, cutoff, stored)
    assert [level.tobytes() for level in found] == [level.tobytes() for level in expected]
    assert [level.shape for level in found] == mipmaps._shapes((shape[1], shape[0]))
