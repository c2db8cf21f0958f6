"""Damage to whole model files: which original, what is done to it, and to which of its files."""

from __future__ import annotations

import copy
import json
import os
import random
import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.model.gltf_files import glb, pad
from tests.model.mutations import mutated_bytes, mutated_json, places
from tests.model.originals import GLTF, ISOLATED, OTHERS, Original
from tests.model.png_files import chunk

NUMBERS: tuple[Any, ...] = (
    0, -0.0, -1, 1e-45, 1e-38, -1e-30, 1e-9, 1.5, 90.0, 1e9, 2e18, 1e30, -1e30, 3.4e38, -3.4e38, 1e100,
    1e154, 1e155, -1e200, 1e300, 1.7e308, 5e-324, 1e400, 2**31 - 1, 2**32, -(2**31), 2**53, 2**63,
    2**64, 10**40, 3.141592653589793, 1.5707963267948966, 0.1, float("nan"), float("inf"),
)  # fmt: skip
FLOATS = np.float32([0, -0.0, 1e-45, 1e-38, 1e-20, 1e10, 1e19, -1e20, 1e30, 3.4e38, -3.4e38, np.inf, np.nan])
WORDS = (
    "nan", "inf", "-inf", "1e400", "1e38", "-1e300", "1e-320", "0", "-1", "4294967295",
    "99999999999999999999", "2147483648", "", "x", "1/2/3/4", "1//", "/", "#", "\\", "\0", "1e", "0x10", "٣",
    "-0", "1_000", ".", "  ", "\n",
)  # fmt: skip
LARGEST = 2**31 - 1
SIZES = (
    (LARGEST, LARGEST), (20_000, 20_000), (65_535, 65_535), (9000, 9000), (100_000, 1), (0, 5), (1, LARGEST),
)  # fmt: skip
URIS = (
    "../secret.png", "/etc/passwd", "file:///etc/passwd", "%2e%2e/secret.png", "..%2fsecret.png",
    "a/../../secret.png", "http://localhost/a.png", "C:\\a.png", "..\\secret.png", "link.png", "folder",
    "pipe", "", ".", "a\0b", "%00", "%ff", "missing.png", "loop", "zeros", "data:,",
    "data:image/png;base64,!!!", "data:image/png;base64,iVBORw0KGgo=", "x" * 5000, "deep/" * 3000 + "a",
    "long" * 64 + ".png", "\ud800.png", "?", "image%200.png#x",
)  # fmt: skip


def make(folder: Path, chance: random.Random) -> tuple[Path, str]:
    """Write one damaged model into a folder; return its path, and what was done to which original."""
    name, original = choose(chance)
    path = original(folder)
    if name in GLTF:
        ways = GLTF_WAYS
    elif path.suffix in (".obj", ".ply", ".off", ".dae", ".xaml", ".step", ".stp", ".stl", ".stl_ascii"):
        ways = TEXT_WAYS
    else:
        ways = (damage_bytes,)
    way = chance.choice(ways)
    what = way(path, chance)
    return path, f"{name}: {what or way.__name__.replace('_', ' ')}"


def choose(chance: random.Random) -> tuple[str, Original]:
    share = chance.random()
    if share < 0.65:
        name = chance.choice(tuple(GLTF))
        return name, GLTF[name]
    kinds = tuple(name for name in OTHERS if (name in ISOLATED) == (share > 0.95))
    name = chance.choice(kinds)
    return name, OTHERS[name]


# any file


def damage_bytes(path: Path, chance: random.Random) -> str:
    path.write_bytes(mutated_bytes(path.read_bytes(), chance))
    return "bytes"


def cut(path: Path, chance: random.Random) -> str:
    data = path.read_bytes()
    path.write_bytes(data[: chance.randrange(len(data))])
    return "cut"


def damage_beside(path: Path, chance: random.Random) -> str:
    """Damage or replace a file beside the model, or else the model."""
    beside = [file for file in sorted(path.parent.iterdir()) if file != path]
    chosen = chance.choice(beside or [path])
    act = chance.randrange(8)
    if act < 3:
        return damage_bytes(chosen, chance)
    if act == 3:
        return cut(chosen, chance)
    if act == 4:
        chosen.write_bytes(bomb(chance))
        return "image bomb"
    chosen.unlink()
    if act == 5:
        chosen.mkdir()
        return "folder"
    if act == 6:
        os.mkfifo(chosen)
        return "pipe"
    target = chance.choice(("/dev/zero", "/etc/passwd", chosen.name, "missing"))
    chosen.symlink_to(target)
    return f"link to {target}"


def bomb(chance: random.Random) -> bytes:
    """A PNG that says, or really has, very many pixels."""
    size = chance.choice(SIZES)
    depth, color_type = chance.choice((1, 8, 16)), chance.choice((0, 2, 3, 6))
    parts = [chunk(b"IHDR", struct.pack(">IIBBBBB", *size, depth, color_type, 0, 0, 0))]
    if chance.random() < 0.3:
        parts.append(chunk(b"iCCP", b"a\0\0" + zlib.compress(bytes(50_000_000), 1)))
    if chance.random() < 0.3:
        parts.append(chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(50_000_000), 1)))
    parts.append(chunk(b"IDAT", zlib.compress(bytes(chance.choice((10, 30_000_000))), 1)))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts) + chunk(b"IEND", b"")


# texts


def damage_words(path: Path, chance: random.Random) -> str:
    """Replace words of a text, repeat a line, or leave it out."""
    parts = re.split(rb"([\s<>=\"',()]+)", path.read_bytes())
    for _ in range(chance.randint(1, 4)):
        place = chance.randrange(len(parts))
        act = chance.random()
        if act < 0.7:
            parts[place] = chance.choice(WORDS).encode()
        elif act < 0.8:
            del parts[place : place + chance.randint(1, 20)]
        elif act < 0.9:
            parts[place:place] = parts[place : place + chance.randint(1, 20)]
        else:
            parts[place] = parts[chance.randrange(len(parts))]
        parts = parts or [b""]
    path.write_bytes(b"".join(parts))
    return "words"


# glTF


def split(path: Path) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk of a file."""
    data = path.read_bytes()
    if data[:4] != b"glTF":
        return json.loads(data), b""
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def join(path: Path, found: Any, binary: bytes) -> None:
    text = json.dumps(found).encode()
    if path.suffix == ".glb":
        text = glb((b"JSON", pad(text, b" ")), *([(b"BIN\0", binary)] if binary else []))
    path.write_bytes(text)


def damage_json(path: Path, chance: random.Random) -> str:
    found, binary = split(path)
    join(path, mutated_json(found, chance), binary)
    return "json"


def damage_numbers(path: Path, chance: random.Random) -> str:
    """Replace numbers of the JSON, but not of what leads to the data."""
    found, binary = split(path)
    leading = {id(each) for kind in ("accessors", "bufferViews", "buffers") for each in found.get(kind, [])}
    numbers = [
        (container, key)
        for container, key in places(found)
        if isinstance(container[key], int | float)
        and not isinstance(container[key], bool)
        and id(container) not in leading
        and (isinstance(container[key], float) or isinstance(container, list) or chance.random() < 0.3)
    ]
    named = []
    for container, key in chance.sample(numbers, min(len(numbers), chance.randint(1, 4))):
        container[key] = chance.choice(NUMBERS)
        named.append(f"{key}={container[key]}")
    join(path, found, binary)
    return f"numbers {', '.join(named)}"


def damage_floats(path: Path, chance: random.Random) -> str:
    """Write extreme floats over accessors of floats."""
    found, binary = split(path)
    data = bytearray(binary)
    floats = [each for each in found["accessors"] if each["componentType"] == 5126 and "bufferView" in each]
    if not data or not floats:
        return damage_numbers(path, chance)
    for accessor in chance.sample(floats, min(len(floats), chance.randint(1, 3))):
        view = found["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        count = max((view["byteLength"] - accessor.get("byteOffset", 0)) // 4, 1)
        chosen = range(count) if chance.random() < 0.3 else [chance.randrange(count) for _ in range(3)]
        pool = FLOATS[: chance.choice((11, 11, 11, 13))]
        value = chance.choice(pool.tolist())
        for place in chosen:
            if start + 4 * place + 4 <= len(data):
                struct.pack_into("<f", data, start + 4 * place, value)
    join(path, found, bytes(data))
    return "floats"


def damage_data(path: Path, chance: random.Random) -> str:
    """Damage the binary chunk alone."""
    found, binary = split(path)
    if not binary:
        return damage_json(path, chance)
    damaged = mutated_bytes(binary, chance).ljust(len(binary), b"\xff")[: len(binary)]
    join(path, found, damaged)
    return "data"


def damage_uris(path: Path, chance: random.Random) -> str:
    """Let an image or buffer be another file, in a folder with links, pipes and folders."""
    found, binary = split(path)
    folder = path.parent
    (folder / "folder").mkdir()
    os.mkfifo(folder / "pipe")
    for name, target in (("link.png", "/etc/passwd"), ("loop", "loop"), ("zeros", "/dev/zero")):
        (folder / name).symlink_to(target)
    uri = chance.choice(URIS)
    kind = "buffers" if chance.random() < 0.3 or not found.get("images") else "images"
    item = chance.choice(found[kind])
    item.pop("bufferView", None)
    item["uri"] = uri
    join(path, found, binary)
    return f"uri {uri[:40]!r} in {kind}"


def damage_image(path: Path, chance: random.Random) -> str:
    found, binary = split(path)
    if not found.get("images") or not binary:
        return damage_beside(path, chance)
    data = bomb(chance)
    view = {"buffer": 0, "byteOffset": len(pad(binary)), "byteLength": len(data)}
    found["bufferViews"].append(view)
    for image in found["images"] if chance.random() < 0.5 else [chance.choice(found["images"])]:
        image.pop("uri", None)
        image["bufferView"] = len(found["bufferViews"]) - 1
    binary = pad(pad(binary) + data)
    found["buffers"][0]["byteLength"] = len(binary)
    join(path, found, binary)
    return "image bomb"


def lie(path: Path, chance: random.Random) -> str:
    """Damage the structure: circles, counts, depth."""
    found, binary = split(path)
    nodes = found["nodes"]
    number = chance.randrange(len(nodes))
    act = chance.randrange(9)
    if act == 0:
        nodes[number]["children"] = [number]
    elif act == 1:
        nodes[number].setdefault("children", []).append(chance.randrange(len(nodes)))
    elif act == 2:
        accessor = chance.choice(found["accessors"])
        accessor["count"] = chance.choice((0, 1, accessor["count"] + 1, 10**6, 10**9, 2**31, 2**40))
    elif act == 3:
        accessor = chance.choice(found["accessors"])
        accessor.pop("bufferView", None)
        accessor["count"] = chance.choice((10**6, 10**7, 10**9, 2**40))
    elif act == 4:
        for _ in range(chance.choice((100, 3000))):
            nodes.append({"children": [number], "scale": [chance.choice((1, 0.5, 2, -1)) for _ in "xyz"]})
            number = len(nodes) - 1
        found["scenes"][0]["nodes"] = [number]
    elif act == 5:
        nodes.extend(copy.deepcopy(nodes[number]) for _ in range(2000))
        found["scenes"][0]["nodes"].extend(range(len(nodes) - 2000, len(nodes)))
    elif act == 6:
        for each in found.get("meshes", []):
            each["primitives"] = each["primitives"] * chance.choice((2, 100))
    elif act == 7:
        for each in chance.choice((found.get("skins"), found.get("animations"))) or []:
            each.update({key: value * 50 for key, value in each.items() if isinstance(value, list)})
    else:
        view = chance.choice(found["bufferViews"])
        view[chance.choice(("byteOffset", "byteLength", "byteStride"))] = chance.choice((0, 1, 3, 255, 2**31))
    join(path, found, binary)
    return f"lie {act}"


def damage_text(path: Path, chance: random.Random) -> str:
    """JSON that is no JSON, or odd: deep, with keys twice, with NaN."""
    found, binary = split(path)
    text = json.dumps(found)
    act = chance.randrange(5)
    if act == 0:
        depth = chance.choice((500, 5000, 200_000))
        text = text[:-1] + ', "extras": ' + "[" * depth + "]" * depth + "}"
    elif act == 1:
        text = text[:-1] + ', "nodes": [], "nodes": [{}]}'
    elif act == 2:
        text = text.replace(
            "0", chance.choice(("NaN", "-Infinity", "1e999", "0" * 5000, "9" * 5000, "[0]")), 1
        )
    elif act == 3:
        text = "\ufeff" + text
    else:
        text = text[:-1] + f', "extras": {"9" * 5000}}}'
    data = text.encode()
    if path.suffix == ".glb":
        data = glb((b"JSON", pad(data, b" ")), *([(b"BIN\0", binary)] if binary else []))
    path.write_bytes(data)
    return f"text {act}"


Way = Callable[[Path, random.Random], str]
GLTF_WAYS: tuple[Way, ...] = (
    damage_bytes, cut, damage_json, damage_json, damage_json, damage_numbers, damage_numbers, damage_floats,
    damage_floats, damage_data, damage_uris, damage_image, damage_beside, lie, lie, damage_text,
)  # fmt: skip
TEXT_WAYS: tuple[Way, ...] = (damage_bytes, cut, damage_words, damage_words, damage_words, damage_beside)
