"""One frame, saved into one file."""

from __future__ import annotations

from pathlib import Path

from firefly_sample.encoding.format import Format
from firefly_sample.encoding.formats import FORMATS, Encoding, formats_for, formats_of_path
from firefly_sample.errors import OutputError
from firefly_sample.frame import OUTPUTS, Frame
from firefly_sample.whole_files import open_whole


def save_frame(
    frame: Frame, path: str | Path, output: str | None, quality: int | None, depth_scale: float | None
) -> None:
    """Write a frame as `Frame.save` describes."""
    path = Path(path)
    if not isinstance(output, str | None):
        raise OutputError(f"{path}: the output is one name, or None for all that fit, got {output!r}")
    kinds = formats_of_path(path)
    if not kinds:
        suffixes = dict.fromkeys(suffix for kind in FORMATS.values() for suffix in kind.suffixes)
        raise OutputError(
            f"{path}: the suffix {path.suffix!r} is no picture's or data's: choose {', '.join(suffixes)}"
        )
    outputs = _outputs(frame, path, kinds[0]) if output is None else (output,)
    images = {name: frame[name] for name in outputs}
    kind = _kind(path, outputs, kinds)
    encoding = Encoding.of(outputs, dict.fromkeys(outputs, kind.name), quality, depth_scale)
    content = kind.encode(images, encoding.choices)
    with open_whole(path) as file:
        file.write(content)


def _outputs(frame: Frame, path: Path, kind: Format) -> tuple[str, ...]:
    """Return the outputs that a file gets if none is named."""
    names = tuple(frame.images)
    if kind.name in ("npz", "exr"):
        data = tuple(name for name in names if OUTPUTS[name].dtype != "uint8")
        if not data:
            raise OutputError(
                f"{path}: {kind.name} is for light and data, and this frame has only {', '.join(names)}: "
                "choose .png, or render it with more outputs"
            )
        return data
    for name in ("color", "color_alpha"):
        if name in names:
            return (name,)
    if len(names) != 1:
        raise OutputError(f"{path}: name the output to save, one of {', '.join(names)}")
    return names


def _kind(path: Path, outputs: tuple[str, ...], kinds: list[Format]) -> Format:
    """Return the first of the formats that can hold the outputs."""
    for kind in kinds:
        if not any(map(kind.refusal, outputs)):
            return kind
    usual = kinds[0]
    name = next(output for output in outputs if usual.refusal(output))
    suffixes = dict.fromkeys(FORMATS[other].suffixes[0] for other in formats_for(name))
    raise OutputError(
        f"{path}: {usual.name} cannot hold the output {name!r}: {usual.refusal(name)}; "
        f"choose {', '.join(suffixes)}"
    )
