"""The list of outputs, and the page that shows it."""

from pathlib import Path

import pytest

from firefly_sample.errors import OutputError
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
