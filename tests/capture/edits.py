"""Changes of captures on disk, as people and accidents make them, and what is said of them."""

from __future__ import annotations

import hashlib
import json

from firefly_sample.capture.files import pixel_hash
from tests.capture.usual_files import decode_image, encode_image


def texts(report):
    assert report.ok == (not report.problems)
    return [problem.text for problem in report.problems]


def notes(report):
    return [note.text for note in report.notes]


def edit(folder, change, name="manifest.json"):
    """Change the manifest, in the form that `json.dumps` gives it."""
    path = folder / name
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content, indent=2))


def edit_image(path, change, output="color"):
    image = decode_image(output, path.read_bytes()).copy()
    change(image)
    path.write_bytes(encode_image(output, image))


def redraw(folder, index, change, output="color"):
    """Change an image and the hashes in the manifest, as if it had been drawn so."""

    def enter(manifest):
        entry = manifest["frames"][index]
        path = folder / entry["files"][output]
        edit_image(path, change, output)
        content = path.read_bytes()
        entry["sha256"][output] = pixel_hash(decode_image(output, content))
        entry["file_sha256"][output] = hashlib.sha256(content).hexdigest()

    edit(folder, enter)


def brighten(image):
    image[3, 4, 0] += 2
