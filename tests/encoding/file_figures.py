"""Measures films and files of the forest, for docs/films.md: `python -m tests.encoding.file_figures`.

The first table has films of 48 frames, the second single frames. Times are of the processor, in all threads.
"""

from __future__ import annotations

import resource
import tempfile
from pathlib import Path

import numpy as np

from firefly_sample import Settings
from firefly_sample.encoding.film import FilmChoices
from firefly_sample.encoding.films import read_film, write_film
from firefly_sample.encoding.formats import Encoding
from firefly_sample.scenes import build_scene, find_scene
from tests.conftest import make_renderer

FILM_SIZE, FILM_FRAMES = (320, 240), 48
FILMS = (
    (".mp4", {}),
    (".mp4", {"crf": 28}),
    (".mp4", {"crf": 0}),
    (".webm", {}),
    (".webm", {"crf": 0}),
    (".webp", {}),
    (".webp", {"quality": 80}),
    (".apng", {}),
    (".gif", {}),
)
SIZE = (1280, 720)
FILES = (
    ("color", "png", {}),
    ("color", "webp", {}),
    ("color", "webp", {"quality": 90}),
    ("color", "jpeg", {}),
    ("radiance", "npz", {}),
    ("radiance", "exr", {}),
    ("radiance", "exr16", {}),
    ("depth", "npz", {}),
    ("depth", "png16", {"depth_scale": 0.01}),
    ("depth", "exr", {}),
    ("id", "npz", {}),
    ("id", "png16", {}),
    ("id", "exr", {}),
)


def seconds() -> float:
    """Processor time of this process so far."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def measure_films() -> None:
    scene = build_scene(find_scene("forest"))
    with make_renderer(FILM_SIZE, Settings(supersample=2)) as renderer:
        times = [5.0 + index / 24 for index in range(FILM_FRAMES)]
        frames = [frame.color for frame in renderer.render_many(scene, times)]
    print(f"{FILM_FRAMES} frames of the forest at {FILM_SIZE[0]}x{FILM_SIZE[1]}")
    for suffix, choices in FILMS:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"film{suffix}")
            start = seconds()
            write_film(path, suffix, iter(frames), FILM_SIZE, FilmChoices(24, **choices))
            spent = 1e3 * (seconds() - start) / FILM_FRAMES
            read = list(read_film(path))
            errors = [np.abs(one.astype(float) - two) for one, two in zip(frames, read, strict=True)]
            root, largest = np.sqrt(np.mean(np.square(errors))), np.max(errors)
            size = path.stat().st_size / FILM_FRAMES / 1e3
            print(
                f"{suffix} {choices}: {size:.1f} kB, {spent:.1f} ms a frame; errors {root:.2f}, {largest:.0f}"
            )


def measure_files() -> None:
    scene = build_scene(find_scene("forest"))
    images = {}
    for outputs in (("color",), ("radiance", "depth", "id")):
        with make_renderer(SIZE, Settings(supersample=2 if outputs == ("color",) else 1)) as renderer:
            images |= renderer.render(scene, 5.0, outputs).images
    print(f"single frames of the forest at {SIZE[0]}x{SIZE[1]}")
    for output, name, choices in FILES:
        encoding = Encoding.of([output], {output: name}, choices.get("quality"), choices.get("depth_scale"))
        (key,) = encoding.files()
        best = np.inf
        for _ in range(3):
            start = seconds()
            content = encoding.encode(key, images)
            best = min(best, seconds() - start)
        again = encoding.decode(key, content)[output]
        same = np.array_equal(again, images[output])
        print(f"{output} {name} {choices}: {len(content) / 1e3:.0f} kB, {1e3 * best:.0f} ms, exact {same}")


if __name__ == "__main__":
    measure_films()
    measure_files()
