"""The two containers of glTF: binary (.glb) and JSON with files beside it or in data URIs (.gltf)."""

from __future__ import annotations

import base64
import binascii
import json
import posixpath
import re
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

from firefly_sample.errors import ModelError

_JSON, _BIN = 0x4E4F534A, 0x004E4942


def read_file(path: Path) -> bytes:
    """Return a file's bytes; raise ModelError if it cannot be read."""
    try:
        if path.is_file():
            return path.read_bytes()
        path.stat()
    except FileNotFoundError:
        raise ModelError(f"model {path}: no such file") from None
    except OSError as error:
        raise ModelError(f"model {path}: cannot be read ({error.strerror})") from None
    except ValueError:  # a name with a null character
        raise ModelError(f"model {str(path)!r}: no such file") from None
    raise ModelError(f"model {path}: not a file")


def split_container(path: Path, data: bytes) -> tuple[dict[str, Any], memoryview | None]:
    """Return the JSON of a .glb or .gltf file, and its binary chunk, None if it has none.

    The first bytes decide which of the two it is, and not the name.
    """
    if not data:
        raise ModelError(f"model {path}: the file is empty")
    if data[:4] == b"glTF":
        return _split_binary(path, data)
    if data[:20].removeprefix(b"\xef\xbb\xbf").lstrip()[:1] != b"{":
        raise ModelError(
            f"model {path}: neither binary glTF (.glb) nor JSON (.gltf): its first bytes are {data[:4]!r}"
        )
    return _parse(path, data), None


def _split_binary(path: Path, data: bytes) -> tuple[dict[str, Any], memoryview | None]:
    """Return the JSON and the binary chunk of a .glb file.

    The layout is that of glTF 2.0, section 4 "GLB file format": twelve bytes of magic, version and total
    length, then chunks, of which the first is JSON. Chunks of other types are ignored, as it says there, and
    so is everything behind the total length.
    """
    if len(data) < 20:
        raise ModelError(f"model {path}: truncated, it ends inside its header ({len(data)} bytes)")
    version, length = struct.unpack_from("<2I", data, 4)
    if version != 2:
        raise ModelError(f"model {path}: glTF version {version}, expected 2: export it as glTF 2")
    if len(data) < length:
        raise ModelError(f"model {path}: truncated, {len(data)} of {length} bytes are there")
    chunks: list[tuple[int, memoryview]] = []
    start = 12
    while start + 8 <= length:
        size, kind = struct.unpack_from("<2I", data, start)
        start += 8
        if start + size > length:
            raise ModelError(
                f"model {path}: damaged, {length - start} of {size} bytes of chunk {len(chunks)} are there"
            )
        chunks.append((kind, memoryview(data)[start : start + size]))
        start += size
    if not chunks or chunks[0][0] != _JSON:
        raise ModelError(f"model {path}: damaged, its first chunk is not JSON")
    binary = next((chunk for kind, chunk in chunks[1:] if kind == _BIN), None)
    return _parse(path, bytes(chunks[0][1])), binary


def _parse(path: Path, text: bytes) -> dict[str, Any]:
    """Return a file's JSON, which is an object; NaN and Infinity, which are not JSON, are refused."""
    try:
        # some programs fill the chunk with zeros in place of spaces
        found = json.loads(text.rstrip(b"\0").decode("utf-8-sig"), parse_constant=_refuse)
    except RecursionError:
        raise ModelError(f"model {path}: damaged JSON (nested too deeply)") from None
    except ValueError as error:
        raise ModelError(f"model {path}: damaged JSON ({' '.join(str(error).split())[:200]})") from None
    if not isinstance(found, dict):
        raise ModelError(f"model {path}: damaged JSON (not an object)")
    return found


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is not a number of JSON")


def is_data_uri(uri: str) -> bool:
    """Return whether a URI holds its data itself."""
    return uri[:5].lower() == "data:"


def decode_data_uri(uri: str) -> tuple[bytes, str]:
    """Return the bytes and the media type of a data URI (RFC 2397); raise ValueError if it is damaged."""
    head, comma, body = uri[5:].partition(",")
    if not comma:
        raise ValueError("a data URI without a comma")
    media_type, *parameters = [part.strip().lower() for part in head.split(";")]
    data = unquote_to_bytes(body)
    if "base64" in parameters:
        digits = b"".join(data.split()).rstrip(b"=")
        try:
            data = base64.b64decode(digits + b"=" * (-len(digits) % 4), validate=True)
        except binascii.Error as error:
            raise ValueError(f"a data URI that is not base64 ({error})") from None
    return data, media_type


def relative_path(uri: str) -> str:
    """Return the relative path of a file that a URI names (RFC 3986), with "/" between folders.

    Raise ValueError, with the reason, if it is absolute, has a scheme such as https, or leaves the folder.
    """
    try:
        name = unquote(uri, errors="strict").replace("\\", "/")
    except UnicodeDecodeError:
        raise ValueError("is not a name in UTF-8") from None
    if re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", name):
        raise ValueError("has a scheme: only files beside the model are read")
    if name.startswith("/"):
        raise ValueError("is absolute: only files beside the model are read")
    name = posixpath.normpath(name)
    if name == ".." or name.startswith("../"):
        raise ValueError("leaves the model's folder: only files in it are read")
    if name == "." or "\0" in name:
        raise ValueError("is no name of a file")
    return name
