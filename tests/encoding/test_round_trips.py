"""Each format gives back the bits of each output that it can hold, and writes the same bytes each time."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from firefly_sample.encoding.format import Choices
from firefly_sample.encoding.formats import FORMATS, LAYERS, Encoding, format_of_path, formats_for
from firefly_sample.frame import OUTPUTS
from tests.encoding.images import assert_same_bits, image_of

PAIRS = [(output, name) for output in OUTPUTS for name in formats_for(output)]
EXACT = [pair for pair in PAIRS if FORMATS[pair[1]].is_exact(pair[0], Choices())]


def fitting(output, name):
    image = image_of(output)
    return image.clip(-1, 65534) if name == "png16" else image


@pytest.mark.parametrize(("output", "name"), EXACT)
def test_the_bits_come_back(output, name):
    image = fitting(output, name)
    kind = FORMATS[name]
    content = kind.encode({output: image}, Choices())
    decoded = kind.decode(content, (output,), Choices())
    assert decoded.keys() == {output}
    assert_same_bits(decoded[output], image)
    assert kind.encode({output: image.copy()}, Choices()) == content


def test_what_each_format_can_hold():
    pictures = {name for name, info in OUTPUTS.items() if info.dtype == "uint8"}
    data = OUTPUTS.keys() - pictures
    atlases = {"shadow_atlas", "particle_shadow_atlas"}
    held = {name: {output for output, other in PAIRS if other == name} for name in FORMATS}
    assert held == {
        "png": pictures,
        "webp": pictures,
        "jpeg": pictures - {"color_alpha"},
        "npz": data,
        "png16": {"depth", "id"},
        "exr": data - atlases,
        "exr16": data - atlases,
    }
    exact = {name: {output for output, other in EXACT if other == name} for name in FORMATS}
    assert exact == held | {
        "jpeg": set(),
        "png16": {"id"},
        "exr16": {"id", "visibility", "overdraw"},
    }


@pytest.mark.parametrize("formats", [None, "exr", "webp"])
def test_all_outputs_by_files(formats):
    outputs = [output for output in OUTPUTS if formats != "exr" or "exr" in formats_for(output)]
    encoding = Encoding.of(outputs, formats)
    images = {output: image_of(output) for output in outputs}
    decoded = {}
    for file, names in encoding.files().items():
        content = encoding.encode(file, images)
        assert format_of_path(f"x{encoding.suffix(file)}").name in dict(encoding.formats).values()
        found = encoding.decode(file, content)
        assert tuple(found) == names
        decoded |= found
    assert decoded.keys() == images.keys()
    for output, image in images.items():
        assert encoding.is_exact(output)
        assert_same_bits(decoded[output], image)


def test_the_same_bytes_from_many_threads():
    encoding = Encoding.of(["color", "depth", "id", "normal"], "webp,depth=npz,exr")
    images = {output: image_of(output) for output in dict(encoding.formats)}
    files = list(encoding.files())
    assert files == ["color", "depth", LAYERS]
    once = [encoding.encode(file, images) for file in files]
    with ThreadPoolExecutor(4) as threads:
        for again in threads.map(lambda _: [encoding.encode(file, images) for file in files], range(12)):
            assert again == once


@pytest.mark.parametrize("name", ["shadow_atlas", "particle_shadow_atlas"])
def test_an_atlas_of_no_size(name):
    image = np.empty((0, 0) if OUTPUTS[name].channels == 1 else (0, 0, 3), np.float32)
    encoding = Encoding.of([name])
    assert_same_bits(encoding.decode(name, encoding.encode(name, {name: image}))[name], image)


@pytest.mark.parametrize("name", FORMATS)
def test_a_damaged_file_is_an_error(name):
    kind = FORMATS[name]
    output = next(output for output in OUTPUTS if not kind.refusal(output))
    image = np.full_like(image_of(output), 1)
    content = kind.encode({output: image}, Choices())
    for damaged in (b"", content[: len(content) // 2], b"\0" * 100 + content[100:]):
        with pytest.raises(Exception) as caught:  # noqa: PT011
            kind.decode(damaged, (output,), Choices())
        assert not isinstance(caught.value, AssertionError | NameError | TypeError)
