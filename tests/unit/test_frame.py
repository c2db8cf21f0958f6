"""The list of outputs, and the page that shows it."""

from pathlib import Path

from firefly_sample.frame import OUTPUTS


def test_the_page_lists_every_output_as_it_is():
    page = Path(__file__, "../../../docs/outputs.md").resolve().read_text()
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert rows == [
        f"| `{name}` | {info.help} | {info.space} | {info.unit} | "
        f"{info.dtype if info.channels == 1 else f'{info.dtype} x {info.channels}'} | {info.invalid} |"
        for name, info in OUTPUTS.items()
    ]
