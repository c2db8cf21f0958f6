"""Opening .glb and .gltf files, checked access to their JSON, and the bytes of buffers."""

from __future__ import annotations

import base64
import json
import os
import struct
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.errors import ModelError
from firefly_sample.model.gltf.document import Document
from tests.model.gltf_files import GltfFile, glb, pad

MINIMAL = {"asset": {"version": "2.0"}}
DATA = bytes(range(12))


def opened(path: Path, found: object) -> Document:
    path.write_text(found if isinstance(found, str) else json.dumps(found), encoding="utf-8")
    return Document.open(path)


def buffer_of(path: Path, uri: str, length: int = len(DATA)) -> bytes:
    return (
        opened(path, MINIMAL | {"buffers": [{"byteLength": length, "uri": uri}]})
        .read_buffer(0, "x")
        .tobytes()
    )


def text(found: object = MINIMAL) -> bytes:
    return pad(json.dumps(found).encode(), b" ")


def with_data(**buffer: object) -> dict[str, object]:
    return MINIMAL | {"buffers": [{"byteLength": len(DATA)} | buffer]}


@pytest.mark.parametrize("name", ["a.glb", "a.gltf"])
def test_a_written_file_has_its_json_and_bytes(tmp_path: Path, name: str) -> None:
    file = GltfFile()
    file.view(DATA, byteStride=4)
    document = Document.open(file.write(tmp_path / name))
    view, stride = document.read_buffer_view(0, "here")
    assert (view.tobytes(), stride, document.path) == (DATA, 4, tmp_path / name)
    assert not view.flags.writeable
    assert document.json["bufferViews"] == file.json["bufferViews"]
    assert document.files == {"": (tmp_path / name).read_bytes()}


def test_all_bytes_that_were_read_are_remembered_by_name(tmp_path: Path) -> None:
    file = GltfFile()
    file.view(DATA)
    document = Document.open(file.write(tmp_path / "a.gltf", beside=True))
    document.read_buffer_view(0, "here")
    assert document.files == {"": (tmp_path / "a.gltf").read_bytes(), "a.bin": DATA}


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "the file is empty"),
        (b"PK\3\4 something", "neither binary"),
        (b"glTF", "truncated, it ends inside its header (4 bytes)"),
        (glb((b"JSON", text()), version=1), "glTF version 1, expected 2: export it as glTF 2"),
        (glb((b"JSON", text()))[:-1], "truncated, "),
        (glb((b"BIN\0", DATA), (b"JSON", text())), "its first chunk is not JSON"),
        (struct.pack("<4s2I", b"glTF", 2, 12) + bytes(8), "its first chunk is not JSON"),
        (struct.pack("<4s4I", b"glTF", 2, 24, 9, 0x4E4F534A) + b"{}  ", "4 of 9 bytes of chunk 0"),
        (glb((b"JSON", b"[1]  ")), "damaged JSON (not an object)"),
        (glb((b"JSON", b'{"a": "\xff"}')), "damaged JSON ('utf-8' codec"),
        (b"{", "damaged JSON (Expecting"),
        (b'{"a": NaN}', "damaged JSON (NaN is not a number of JSON)"),
        (b'{"a": -Infinity}', "damaged JSON (-Infinity is not a number of JSON)"),
        (b'{"a": 1' + b"0" * 5000 + b"}", "damaged JSON (Exceeds the limit"),
        (b'{"a": ' + b"[" * 200_000, "damaged JSON (nested too deeply)"),
        (b"{}", "asset: is missing"),
        (b'{"asset": []}', "asset: must be an object, got a list of 0"),
    ],
)
def test_a_damaged_container_is_one_line_with_the_file(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(data)
    with pytest.raises(ModelError) as raised:
        Document.open(path)
    assert str(raised.value).startswith(f"model {path}: ")
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    for path, message in (
        (tmp_path / "none.glb", "no such file"),
        (tmp_path, "not a file"),
        (tmp_path / "a\0b", "no such file"),
    ):
        with pytest.raises(ModelError, match=message):
            Document.open(path)


@pytest.mark.parametrize(
    "data",
    [
        glb((b"JSON", text(with_data())), (b"BIN\0", DATA)) + b"behind the end",
        glb((b"JSON", text(with_data())), (b"BIN\0", DATA + b"\0\0\0")),  # padded, and three bytes too long
        glb((b"JSON", text(with_data())), (b"EXTR", b"what"), (b"BIN\0", DATA), (b"EXTR", b"else")),
        glb((b"JSON", text(with_data()) + b"\0\0\0\0"), (b"BIN\0", DATA)),
        glb((b"JSON", b"\xef\xbb\xbf " + text(with_data())), (b"BIN\0", DATA)),
        b"\xef\xbb\xbf \n"
        + text(with_data(uri="data:;base64," + base64.b64encode(DATA).decode())),  # JSON, whatever its name
    ],
    ids=["bytes behind", "long chunk", "other chunks", "padded with zeros", "byte order mark", "text"],
)
def test_what_is_only_unusual_is_read(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(data)
    assert Document.open(path).read_buffer(0, "x").tobytes() == DATA


@pytest.mark.parametrize(
    ("asset", "is_read"),
    [
        ({"version": "2.0"}, True),
        ({"version": "2.1"}, True),  # a later minor version, which only adds
        ({"version": "2.1", "minVersion": "2.0"}, True),
        ({"version": "2.1", "minVersion": "2.1"}, False),
        ({"version": "1.0"}, False),
        ({"version": "3.0", "minVersion": "2.0"}, True),
        ({"version": "3.0"}, False),
        ({"version": "two"}, False),
        ({"version": 2.0}, False),
        ({}, False),
    ],
)
def test_versions(tmp_path: Path, asset: dict[str, object], is_read: bool) -> None:
    if is_read:
        opened(tmp_path / "a.gltf", {"asset": asset})
    else:
        with pytest.raises(ModelError, match="asset"):
            opened(tmp_path / "a.gltf", {"asset": asset})


# checked access


def thing(tmp_path: Path, **properties: object):
    document = opened(tmp_path / "a.gltf", MINIMAL | {"meshes": [{}, properties]})
    return document.item("meshes", 1, "here")


def test_getters_return_what_is_there(tmp_path: Path) -> None:
    found = thing(
        tmp_path,
        n=3,
        f=2.0,
        x=0.5,
        t="é",
        b=False,
        v=[1, 2.5],
        o={"k": 1},
        l=[{"a": 1}, {"a": 2}],
        i=1,
        many=[0, 1],
        extensions={"EXT_x": {"y": 7}},
    )
    assert (found.whole("n"), found.whole("f"), found.number("n"), found.number("x")) == (3, 2, 3.0, 0.5)
    assert (found.text("t"), found.flag("b"), found.numbers("v", 2)) == ("é", False, (1.0, 2.5))
    assert found.required_object("o").whole("k") == 1
    assert [each.whole("a") for each in found.objects("l")] == [1, 2]
    assert (found.index("i", "meshes"), found.indices("many", "meshes")) == (1, (0, 1))
    extension = found.extension("EXT_x")
    assert extension is not None
    assert extension.place("y") == "meshes[1].extensions.EXT_x.y"


def test_getters_return_defaults_for_what_is_not_there(tmp_path: Path) -> None:
    found = thing(tmp_path)
    assert (found.whole("n", 4), found.number("x", None), found.text("t", "a"), found.flag("b", True)) == (
        4,
        None,
        "a",
        True,
    )
    assert (found.numbers("v", 3, None), found.object("o"), found.objects("l"), found.extension("E")) == (
        None,
        None,
        [],
        None,
    )
    assert (found.index("i", "meshes"), found.indices("many", "meshes")) == (None, ())


@pytest.mark.parametrize(
    ("read", "value", "message"),
    [
        (lambda o: o.whole("k"), True, "must be a whole number, got true"),
        (lambda o: o.whole("k"), "1", "must be a whole number, got '1'"),
        (lambda o: o.whole("k"), 1.5, "must be a whole number, got 1.5"),
        (lambda o: o.whole("k"), -1, "must be at least 0, got -1"),
        (lambda o: o.whole("k", most=6), 7, "must be 0 to 6, got 7"),
        (lambda o: o.whole("k", 5), None, "must be a whole number, got None"),
        (lambda o: o.number("k"), False, "must be a number, got false"),
        (lambda o: o.number("k"), 10**400, "must be a finite number, got one that is too large"),
        (lambda o: o.number("k", least=0, most=1), 1.5, "must be 0 to 1, got 1.5"),
        (lambda o: o.numbers("k", 3), [1, 2], "must be 3 numbers, got 2"),
        (lambda o: o.numbers("k", 3), 5, "must be a list, got 5"),
        (lambda o: o.text("k"), 5, "must be a text, got 5"),
        (lambda o: o.flag("k"), 1, "must be true or false, got 1"),
        (lambda o: o.object("k"), [], "must be an object, got a list of 0"),
        (lambda o: o.objects("k"), {}, "must be a list, got an object of 0"),
        (lambda o: o.index("k", "meshes"), 2, "refers to meshes[2], but the file has 2 meshes"),
        (lambda o: o.index("k", "skins"), 0, "refers to skins[0], but the file has 0 skins"),
        (lambda o: o.index("k", "meshes"), -1, "must be at least 0, got -1"),
    ],
)
def test_getters_refuse_other_types_and_name_the_place(tmp_path: Path, read, value, message: str) -> None:
    with pytest.raises(ModelError) as raised:
        read(thing(tmp_path, k=value))
    assert str(raised.value) == f"model {tmp_path / 'a.gltf'}: meshes[1].k: {message}"


def test_places_are_those_in_lists(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"meshes\[1\]\.v\[1\]: must be a number"):
        thing(tmp_path, v=[1, "a"]).numbers("v", 2)
    with pytest.raises(ModelError, match=r"meshes\[1\]\.l\[1\]: must be an object"):
        thing(tmp_path, l=[{}, 4]).objects("l")
    with pytest.raises(ModelError, match=r"meshes\[1\]\.l\[0\]\.a: is missing"):
        thing(tmp_path, l=[{}]).objects("l")[0].whole("a")
    with pytest.raises(ModelError, match=r"meshes\[1\]\.many\[1\]: refers to meshes\[9\]"):
        thing(tmp_path, many=[0, 9]).indices("many", "meshes")


def test_numbers_that_a_float_cannot_hold_are_refused(tmp_path: Path) -> None:
    document = opened(tmp_path / "a.gltf", '{"asset": {"version": "2.0"}, "meshes": [{"k": 1e999}]}')
    with pytest.raises(ModelError, match="must be a finite number"):
        document.item("meshes", 0, "x").number("k")


def test_half_characters_do_not_reach_names(tmp_path: Path) -> None:
    found = thing(tmp_path, t="a\ud800b", u="\U0001f98b")
    assert (found.text("t"), found.text("u")) == ("a?b", "\U0001f98b")


# bytes


@pytest.mark.parametrize(
    "uri",
    [
        "data:application/octet-stream;base64," + base64.b64encode(DATA).decode(),
        "data:;base64," + base64.b64encode(DATA).decode().rstrip("="),
        "DATA:application/gltf-buffer;charset=x;BASE64,"
        + base64.b64encode(DATA).decode().replace("A", "%41"),
        "data:," + "".join(f"%{byte:02x}" for byte in DATA),
    ],
)
def test_data_uris(tmp_path: Path, uri: str) -> None:
    assert buffer_of(tmp_path / "a.gltf", uri) == DATA


def test_files_beside_the_model(tmp_path: Path) -> None:
    (tmp_path / "folder é").mkdir()
    (tmp_path / "folder é" / "b c.bin").write_bytes(DATA)
    for uri in (
        "folder é/b c.bin",
        "folder%20%C3%A9/b%20c.bin",
        "folder%20%C3%A9\\b%20c.bin",
        "./folder é/../folder é/b c.bin",
    ):
        assert buffer_of(tmp_path / "a.gltf", uri) == DATA
    assert buffer_of(tmp_path / "a.gltf", "folder é/b c.bin", 5) == DATA[:5]


@pytest.mark.parametrize(
    ("uri", "message"),
    [
        ("none.bin", "'none.bin': no such file"),
        ("../secret.bin", "leaves the model's folder"),
        ("%2e%2e/secret.bin", "leaves the model's folder"),
        ("..\\secret.bin", "leaves the model's folder"),
        ("folder/../../secret.bin", "leaves the model's folder"),
        ("/etc/passwd", "is absolute"),
        ("%2Fetc/passwd", "is absolute"),
        ("//host/file", "is absolute"),
        ("https://host/file.bin", "has a scheme"),
        ("file:///etc/passwd", "has a scheme"),
        ("C:/file.bin", "has a scheme"),
        ("", "is no name of a file"),
        (".", "is no name of a file"),
        ("a%00b", "is no name of a file"),
        ("%ff", "is not a name in UTF-8"),
        ("folder", "'folder': not a file"),
        ("x" * 5000, "cannot be read"),
        ("data:abc", "a data URI without a comma"),
        ("data:;base64,a$$$", "a data URI that is not base64"),
        ("data:;base64,AAAA", "is 12, but only 3 bytes are there"),
        ("short.bin", "is 12, but only 3 bytes are there"),
    ],
)
def test_uris_that_are_refused(tmp_path: Path, uri: str, message: str) -> None:
    folder = tmp_path / "inner"
    (folder / "folder").mkdir(parents=True)
    (tmp_path / "secret.bin").write_bytes(DATA)
    (folder / "short.bin").write_bytes(b"abc")
    with pytest.raises(ModelError) as raised:
        buffer_of(folder / "a.gltf", uri)
    assert message in str(raised.value)
    assert str(raised.value).startswith(f"model {folder / 'a.gltf'}: buffers[0].")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.bin")
    with pytest.raises(ModelError, match="not a file"):
        buffer_of(tmp_path / "a.gltf", "pipe.bin")


def test_a_buffer_without_data(tmp_path: Path) -> None:
    document = opened(tmp_path / "a.gltf", with_data())
    assert not document.has_data(0)
    with pytest.raises(ModelError, match=r"buffers\[0\]: has no data: neither a uri nor a binary chunk"):
        document.read_buffer(0, "x")


@pytest.mark.parametrize(
    ("view", "message"),
    [
        ({"buffer": 0, "byteLength": 13}, "ends at byte 13 of a buffer that has 12 bytes"),
        ({"buffer": 0, "byteOffset": 6, "byteLength": 7}, "ends at byte 13"),
        ({"buffer": 0, "byteLength": 10**18}, "ends at byte 1000000000000000000"),
        ({"buffer": 0, "byteLength": 10**30}, "ends at byte a number above 1e20"),
        ({"buffer": 0, "byteOffset": -1, "byteLength": 1}, r"byteOffset: must be at least 0"),
        ({"buffer": 1, "byteLength": 1}, r"buffer: refers to buffers\[1\]"),
        ({"byteLength": 1}, "buffer: is missing"),
        ({"buffer": 0}, "byteLength: is missing"),
        ({"buffer": 0, "byteLength": 4, "byteStride": 0.5}, "byteStride: must be a whole number"),
    ],
)
def test_buffer_views_lie_in_their_buffer(tmp_path: Path, view: dict[str, object], message: str) -> None:
    file = GltfFile()
    file.data = DATA
    file.add("bufferViews", **view)
    document = Document.open(file.write(tmp_path / "a.glb"))
    with pytest.raises(ModelError, match=rf"bufferViews\[0\].*{message}"):
        document.read_buffer_view(0, "x")


def test_buffer_views_that_are_empty(tmp_path: Path) -> None:
    file = GltfFile()
    file.data = DATA
    file.add("bufferViews", buffer=0, byteOffset=12, byteLength=0)
    view, _ = Document.open(file.write(tmp_path / "a.glb")).read_buffer_view(0, "x")
    assert view.dtype == np.uint8
    assert len(view) == 0


def test_a_file_cannot_become_more_numbers_than_it_has_bytes_for(tmp_path: Path) -> None:
    document = opened(tmp_path / "a.gltf", MINIMAL)
    document.claim(15_000_000, "accessors[0]")
    with pytest.raises(ModelError, match=r"accessors\[1\]: too large"):
        document.claim(2_000_000, "accessors[1]")


def test_lists_of_extensions(tmp_path: Path) -> None:
    document = opened(
        tmp_path / "a.gltf", MINIMAL | {"extensionsUsed": ["A", "B"], "extensionsRequired": ["B"]}
    )
    assert (document.extensions_used(), document.extensions_required()) == (("A", "B"), ("B",))
    for wrong in ("A", [1], {"A": 1}):
        document = opened(tmp_path / "a.gltf", MINIMAL | {"extensionsRequired": wrong})
        with pytest.raises(ModelError, match="extensionsRequired: must be a list of names"):
            document.extensions_required()
