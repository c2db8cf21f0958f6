"""Images of glTF files: where they are, their limit, and damage to them."""

from __future__ import annotations

import base64
import io
import zlib

import numpy as np
import pytest
from PIL import Image

from firefly_sample import load_model
from firefly_sample.disk_cache import VARIABLE
from firefly_sample.errors import ModelError
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.reader import read_gltf
from tests.model.gltf_files import GltfFile
from tests.model.quads import read, shaded

PIXELS = np.random.default_rng(1).integers(0, 256, (4, 6, 4), dtype=np.uint8)


def encoded(kind: str = "PNG", pixels: np.ndarray = PIXELS) -> bytes:
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, kind, **({"lossless": True, "exact": True} if kind == "WEBP" else {}))
    return data.getvalue()


def shown(file: GltfFile, texture: dict, **image: object) -> GltfFile:
    """A quad with a texture of an image that is described here."""
    texture = {"source": file.add("images", **image), **texture}
    info = {"index": file.add("textures", **texture)}
    return shaded(file, pbrMetallicRoughness={"baseColorTexture": info, "metallicFactor": 0})


def uri(data: bytes, mime: str = "image/png") -> str:
    return f"data:{mime};base64,{base64.b64encode(data).decode()}"


@pytest.mark.parametrize("mime", ["image/png", "image/jpeg", "text/plain"])
def test_an_image_in_a_buffer_view_is_known_by_its_bytes(tmp_path, mime):
    file = GltfFile()
    model = read(shown(file, {}, bufferView=file.view(encoded()), mimeType=mime, name="leaf"), tmp_path)
    (image,) = model.images
    assert (image.name, image.size) == ("leaf", (6, 4))
    np.testing.assert_array_equal(image.decode(), PIXELS)


def test_an_image_in_a_data_uri(tmp_path):
    (image,) = read(shown(GltfFile(), {}, uri=uri(encoded())), tmp_path).images
    assert image.name == "image 0"
    np.testing.assert_array_equal(image.decode(), PIXELS)


def test_an_image_beside_the_file(tmp_path):
    (tmp_path / "a folder").mkdir()
    (tmp_path / "a folder" / "leaf.png").write_bytes(encoded())
    file = shown(GltfFile(), {}, uri="a%20folder/leaf.png")
    (image,) = read_gltf(Document.open(file.write(tmp_path / "m.gltf"))).images
    assert image.name == "a%20folder/leaf.png"
    np.testing.assert_array_equal(image.decode(), PIXELS)


def test_webp_is_preferred_to_its_fallback(tmp_path):
    file = GltfFile()
    webp = file.add("images", bufferView=file.view(encoded("WEBP")), mimeType="image/webp")
    file.json["extensionsUsed"] = file.json["extensionsRequired"] = ["EXT_texture_webp"]
    more = {"extensions": {"EXT_texture_webp": {"source": webp}}}
    model = read(shown(file, more, uri=uri(encoded(pixels=PIXELS[:2]))), tmp_path)
    (image,) = model.images
    np.testing.assert_array_equal(image.decode(), PIXELS)


def test_a_texture_in_another_form_alone_is_named(tmp_path):
    file = GltfFile()
    source = file.add("images", uri="leaf.ktx2")
    texture = file.add("textures", extensions={"KHR_texture_basisu": {"source": source}})
    shaded(file, pbrMetallicRoughness={"baseColorTexture": {"index": texture}, "metallicFactor": 0})
    model = read(file, tmp_path)
    assert model.materials[0].texture is None
    assert model.losses == ["textures without a PNG, JPEG or WebP image are left out, of materials: 'paint'"]


def test_images_and_textures_are_read_once(tmp_path):
    file = GltfFile()
    image = file.add("images", uri=uri(encoded()))
    sharp = file.add("samplers", magFilter=9728)
    textures = [file.add("textures", source=image), file.add("textures", source=image, sampler=sharp)]
    for texture in (*textures, textures[0]):
        shaded(file, pbrMetallicRoughness={"baseColorTexture": {"index": texture}})
    model = read(file, tmp_path)
    assert [texture.image for texture in model.textures] == [0, 0]
    assert [made.texture for made in model.materials] == [0, 1, 0]
    root = load_model(file.write(tmp_path / "m.glb"))
    used = [path.node().geoms[0][1].texture for path in root.get_children()]
    assert used[0] is used[2]
    assert [texture.magfilter for texture in used[:2]] == ["linear", "nearest"]
    for texture in used:
        np.testing.assert_array_equal(texture.pixels, PIXELS)


def test_an_image_above_the_limit_is_refused_by_its_header(tmp_path):
    """The header promises 40,000 x 30,000 pixels; there are none, and nothing is decoded."""
    data = bytearray(encoded())
    data[16:24] = (40_000).to_bytes(4, "big") + (30_000).to_bytes(4, "big")
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    file = shown(GltfFile(), {}, uri=uri(bytes(data)), name="huge")
    with pytest.raises(
        ModelError,
        match=r"model\.glb: image 'huge' of material 'paint' has 40000x30000 pixels, more than "
        r"max_texture_megapixels=100 allows",
    ):
        read(file, tmp_path)


def test_the_limit_can_be_set(tmp_path):
    path = shown(GltfFile(), {}, uri=uri(encoded())).write(tmp_path / "m.glb")
    load_model(path, max_texture_megapixels=24e-6)
    with pytest.raises(ModelError, match="6x4 pixels, more than max_texture_megapixels=2e-05 allows"):
        load_model(path, max_texture_megapixels=20e-6)


@pytest.mark.parametrize("cache", ["off", "kept"])
@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_a_damaged_image_is_an_error_when_the_model_is_loaded(tmp_path, monkeypatch, kind, cache):
    monkeypatch.setenv(VARIABLE, cache if cache == "off" else str(tmp_path / cache))
    pixels = np.random.default_rng(2).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    path = shown(GltfFile(), {}, uri=uri(encoded(kind, pixels)[:-900]), name="leaf").write(tmp_path / "m.glb")
    for _ in range(2):
        with pytest.raises(
            ModelError, match=r"m\.glb: image 'leaf' of material 'paint' (is damaged|cannot be read): "
        ) as said:
            load_model(path)
        assert "\n" not in str(said.value)


@pytest.mark.parametrize(
    ("image", "message"),
    [
        ({}, r"images\[0\]: has neither a uri nor a bufferView"),
        ({"uri": "absent.png"}, r"images\[0\]\.uri: 'absent\.png': no such file"),
        ({"uri": "../up.png"}, r"leaves the model's folder"),
        (
            {"uri": "data:image/gif;base64,R0lGODlh"},
            r"image 'image 0' of material 'paint' cannot be read: its first bytes are b'GIF89a",
        ),
        ({"bufferView": 99}, r"images\[0\]\.bufferView: refers to bufferViews\[99\]"),
    ],
)
def test_damage_is_named(tmp_path, image, message):
    with pytest.raises(ModelError, match=message):
        read(shown(GltfFile(), {}, **image), tmp_path)


def test_an_image_that_is_not_drawn_may_be_missing(tmp_path):
    file = GltfFile()
    texture = {"index": file.add("textures", source=file.add("images", uri="absent.png"))}
    unlit = {"KHR_materials_unlit": {}}
    path = shaded(file, normalTexture=texture, extensions=unlit).write(tmp_path / "m.gltf")
    assert load_model(path).node().warnings == ()


@pytest.mark.parametrize("key", ["normalTexture", "occlusionTexture", "metallicRoughnessTexture"])
def test_maps_are_read_as_base_colour_textures_are(tmp_path, key):
    """Without an image they are left out; with a damaged or missing one there is an error."""
    for source, message in (({}, None), ({"source": 0}, "absent.png")):
        file = GltfFile()
        file.add("images", uri="absent.png")
        info = {"index": file.add("textures", **source)}
        material = {"pbrMetallicRoughness": {key: info}} if key.startswith("metal") else {key: info}
        path = shaded(file, **material).write(tmp_path / "m.gltf")
        if message is None:
            line = "textures without a PNG, JPEG or WebP image are left out, of materials: 'paint'"
            assert load_model(path).node().warnings == (line,)
        else:
            with pytest.raises(ModelError, match=message):
                load_model(path)


def test_another_image_beside_the_file_is_another_model(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    path = shown(GltfFile(), {}, uri="leaf.png").write(tmp_path / "m.gltf")
    for pixels in (PIXELS, PIXELS[:, ::-1], PIXELS):
        (tmp_path / "leaf.png").write_bytes(encoded(pixels=pixels))
        (path_to_quad,) = load_model(path).get_children()
        np.testing.assert_array_equal(path_to_quad.node().geoms[0][1].texture.pixels, pixels)
