"""The list of outputs, the page that shows it, and what a frame shows of itself."""

import io
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageShow

from firefly_sample.errors import OutputError, ViewerError
from firefly_sample.frame import OUTPUTS, check_outputs
from tests.scenes import wall_scene


def test_a_misspelt_output_gets_the_one_that_was_meant(render):
    frame = render(wall_scene(), None, (4, 3))
    for ask in (lambda: check_outputs(["depth", "colour"]), lambda: frame["colour"]):
        with pytest.raises(
            OutputError, match=r"^there is no output 'colour' \(did you mean 'color'\?\): choose"
        ):
            ask()
    with pytest.raises(OutputError, match=r"^there is no output 'xyz': choose from color, "):
        check_outputs(["xyz"])
    with pytest.raises(OutputError, match=r"this frame has no 'depth': .* add 'depth' to them"):
        frame["depth"]


def test_the_page_lists_every_output_as_it_is():
    page = Path(__file__, "../../../docs/outputs.md").resolve().read_text()
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert rows == [
        f"| `{name}` | {info.help} | {info.space} | {info.unit} | "
        f"{info.dtype if info.channels == 1 else f'{info.dtype} x {info.channels}'} | {info.invalid} |"
        for name, info in OUTPUTS.items()
    ]


def test_a_frame_prints_two_lines(render):
    frame = render(wall_scene(), None, (4, 3), ("color", "depth"), time=2.5)
    first, second = repr(frame).splitlines()
    assert first == "<Frame 4x3 at 2.5 s: color uint8 (3, 4, 3), depth float32 (3, 4);"
    assert second == f" 0 of 0 lights in view; {frame.driver}>"
    assert repr(replace(frame, images={})).startswith("<Frame 4x3 at 2.5 s: no images;")


@pytest.mark.parametrize(
    ("outputs", "shown"),
    [
        (("depth", "color_alpha", "color"), "color"),
        (("volumes", "color_alpha"), "color_alpha"),
        (("id", "volumes"), "volumes"),
        (("depth", "id"), None),
    ],
)
def test_a_notebook_shows_the_picture(render, outputs, shown):
    frame = render(wall_scene(), None, (16, 12), outputs)
    png = frame._repr_png_()
    if shown is None:
        assert png is None
        return
    with Image.open(io.BytesIO(png)) as read:
        assert read.format == "PNG"
        np.testing.assert_array_equal(np.asarray(read), frame[shown])


class Programs(ImageShow.Viewer):
    """A program for pictures, which Pillow lets others add: it keeps what it is given."""

    format = "PNG"

    def __init__(self):
        self.seen = []

    def show_image(self, image, **options):
        self.seen.append(np.asarray(image))
        return 1


def test_show_hands_the_picture_to_pillow(render, monkeypatch):
    frame = render(wall_scene(), None, (16, 12), ("color", "volumes", "depth"))
    program = Programs()
    monkeypatch.setattr(ImageShow, "_viewers", [])
    monkeypatch.setenv("DISPLAY", ":0")
    with pytest.raises(ViewerError, match=r"^color at 0 s: Pillow finds no program that shows pictures"):
        frame.show()
    ImageShow.register(program)
    frame.show()
    frame.show("volumes")
    np.testing.assert_array_equal(program.seen, [frame.color, frame.volumes])
    with pytest.raises(
        OutputError, match=r"^output 'depth' is float32 data and not a picture: .*frame\.depth"
    ):
        frame.show("depth")
    with pytest.raises(OutputError, match=r"this frame has no 'color'"):
        replace(frame, images={"depth": frame.depth}).show()
    with pytest.raises(OutputError, match=r"there is no output 'colour'"):
        frame.show("colour")


@pytest.mark.skipif(
    os.name != "posix" or sys.platform == "darwin", reason="only there is a display a variable"
)
def test_show_without_a_display_says_so(render, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(
        ViewerError, match=r"^color at 0 s: this process has no display \(DISPLAY is not set\)"
    ):
        render(wall_scene(), None, (4, 3)).show()
