"""The table of formats, and which output of a frame goes into which file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from firefly_sample.encoding.exr import Exr, Exr16, encode_layers
from firefly_sample.encoding.format import Choices, Format
from firefly_sample.encoding.npz import Npz
from firefly_sample.encoding.pictures import Jpeg, Png, WebP
from firefly_sample.encoding.png16 import Png16
from firefly_sample.errors import OutputError, did_you_mean
from firefly_sample.frame import OUTPUTS, Image, check_outputs
from firefly_sample.settings import to_whole

FORMATS: dict[str, Format] = {kind.name: kind() for kind in (Png, WebP, Jpeg, Npz, Png16, Exr, Exr16)}
"""Every format by name; of those with one suffix, the first is the usual one."""

LAYERS = "layers"
"""The key of the file with all outputs whose formats have layers."""

_DEPTH_SCALES = (1e-30, 1e30)
_Pairs = tuple[tuple[str, str], ...]
"""Outputs and their formats."""


def format_of_path(path: str | Path) -> Format | None:
    """Return the usual format of a file's suffix; None if no format has it."""
    return next(iter(formats_of_path(path)), None)


def formats_of_path(path: str | Path) -> list[Format]:
    """Return the formats of a file's suffix, the usual one first."""
    suffix = Path(path).suffix.lower()
    return [kind for kind in FORMATS.values() if suffix in kind.suffixes]


def formats_for(output: str) -> list[str]:
    """Return the names of the formats that can hold an output."""
    return [name for name, kind in FORMATS.items() if not kind.refusal(output)]


@dataclass(frozen=True)
class Encoding:
    """The formats of a capture's outputs, and the files that hold them. It can be pickled.

    Attributes
    ----------
    formats : tuple of (str, str)
        Each output and the name of its format.
    choices : Choices
        Numbers that some formats need.
    """

    formats: tuple[tuple[str, str], ...] = ()
    choices: Choices = field(default_factory=Choices)

    @classmethod
    def of(
        cls,
        outputs: Iterable[str],
        formats: str | Iterable[str] | Mapping[str, str] | None = None,
        quality: int | None = None,
        depth_scale: float | None = None,
        usual: Mapping[str, str] | None = None,
    ) -> Encoding:
        """Return the encoding that a user asks for, or raise an OutputError.

        Parameters
        ----------
        outputs : iterable of str
            The outputs of the frames.
        formats : str, iterable of str, mapping or None
            Names of formats, and pairs such as ``depth=png16``; a text may hold several, separated by commas.
            A mapping gives the format of each output in it. A name goes to every output that it can hold and
            that no pair names. All other outputs are PNG if they are 8-bit pictures, and else npz.
        quality : int or None
            Of WebP and JPEG, 1 to 100.
        depth_scale : float or None
            Scene units of one code of a 16-bit depth; None for a thousandth.
        usual : mapping, optional
            The formats of outputs for which `formats` chooses none, in place of PNG and npz.
        """
        names = check_outputs(outputs)
        pairs, bare = _parsed(formats)
        chosen = _paired(names, pairs)
        _spread(names, chosen, bare)
        default = {name: "png" if OUTPUTS[name].dtype == "uint8" else "npz" for name in names}
        default |= usual or {}
        all_formats = tuple((name, chosen.get(name, default[name])) for name in names)
        return cls(all_formats, _choices(all_formats, quality, depth_scale))

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Encoding:
        """Return the encoding that `as_json` has described, or raise an OutputError."""
        unknown = sorted(set(values) - {"formats", "quality", "depth_scale"})
        formats = values.get("formats")
        if unknown or not isinstance(formats, Mapping):
            raise OutputError(f"formats, quality and depth_scale describe an encoding, got {values!r}")
        return cls.of(formats, formats, values.get("quality"), values.get("depth_scale"))

    def as_json(self) -> dict[str, Any]:
        """Return the encoding as plain values: the formats, and of the numbers those that files depend on."""
        values: dict[str, Any] = {"formats": dict(self.formats)}
        used = _used(self.formats)
        if "quality" in used and self.choices.quality is not None:
            values["quality"] = self.choices.quality
        if "depth_scale" in used:
            values["depth_scale"] = self.choices.depth_scale
        return values

    def require(self) -> None:
        """Raise a MissingPackageError if a package that a format needs is not installed."""
        for _, name in self.formats:
            FORMATS[name].require()

    @property
    def outputs(self) -> tuple[str, ...]:
        """The outputs that have a file."""
        return tuple(output for output, _ in self.formats)

    def files(self) -> dict[str, tuple[str, ...]]:
        """Return the outputs of each of a frame's files.

        The key is the output; for the file with layers, whatever their number, it is `LAYERS`.
        """
        files: dict[str, tuple[str, ...]] = {}
        for output, name in self.formats:
            key = LAYERS if FORMATS[name].has_layers else output
            files[key] = (*files.get(key, ()), output)
        return files

    def suffix(self, file: str) -> str:
        """Return the suffix of one of the `files`, for example ".png"."""
        return self._format(file).suffixes[0]

    def encode(self, file: str, images: Mapping[str, Image]) -> bytes:
        """Return the content of one of the `files`; `images` has at least its outputs."""
        wanted = {output: images[output] for output in self.files()[file]}
        if file == LAYERS:
            formats = dict(self.formats)
            return encode_layers(wanted, [output for output in wanted if formats[output] == Exr16.name])
        return self._format(file).encode(wanted, self.choices)

    def decode(self, file: str, content: bytes) -> dict[str, Image]:
        """Return the images in one of the `files`; raise any exception if it is damaged."""
        return self._format(file).decode(content, self.files()[file], self.choices)

    def is_exact(self, output: str) -> bool:
        """Return whether an output's decoded image has the same bits as the encoded one."""
        return FORMATS[dict(self.formats)[output]].is_exact(output, self.choices)

    def _format(self, file: str) -> Format:
        return FORMATS[dict(self.formats)[self.files()[file][0]]]


def _parsed(
    formats: str | Iterable[str] | Mapping[str, str] | None,
) -> tuple[_Pairs, list[str]]:
    """Return the pairs of output and format, and the names of formats without an output."""
    if formats is None:
        return (), []
    if isinstance(formats, Mapping):
        return tuple((output, _checked(name)) for output, name in formats.items()), []
    pairs: list[tuple[str, str]] = []
    bare: list[str] = []
    for text in [formats] if isinstance(formats, str) else formats:
        if not isinstance(text, str):
            raise OutputError(
                f"a format is a name such as 'png' or a pair such as 'depth=png16', got {text!r}"
            )
        for part in text.split(","):
            first, sign, second = (piece.strip() for piece in part.partition("="))
            if sign:
                pairs.append((first, _checked(second)))
            else:
                bare.append(_checked(first))
    return tuple(pairs), bare


def _checked(name: Any) -> str:
    if not isinstance(name, str) or name not in FORMATS:
        raise OutputError(
            f"there is no format {name!r}{did_you_mean(name, FORMATS)}: choose from {', '.join(FORMATS)}"
        )
    return name


def _paired(outputs: tuple[str, ...], pairs: _Pairs) -> dict[str, str]:
    """Return the formats of the outputs that pairs name."""
    chosen: dict[str, str] = {}
    for output, name in pairs:
        check_outputs([output])
        if output not in outputs:
            raise OutputError(
                f"output {output!r} has the format {name}, but is not asked for: "
                f"add it to the outputs {', '.join(outputs)}, or leave its format out"
            )
        _check_one(output, chosen, name)
        refusal = FORMATS[name].refusal(output)
        if refusal:
            raise OutputError(
                f"{name} cannot hold the output {output!r}: {refusal}; "
                f"choose {', '.join(formats_for(output))}"
            )
        chosen[output] = name
    return chosen


def _spread(outputs: tuple[str, ...], chosen: dict[str, str], names: list[str]) -> None:
    """Give each format to the outputs that it can hold, and that are not in `chosen`; put them there."""
    free = [output for output in outputs if output not in chosen]
    for name in names:
        held = [output for output in free if not FORMATS[name].refusal(output)]
        if not held:
            raise OutputError(_nothing_for(name, outputs, chosen))
        for output in held:
            _check_one(output, chosen, name)
            chosen[output] = name


def _check_one(output: str, chosen: Mapping[str, str], name: str) -> None:
    if output in chosen:
        raise OutputError(
            f"output {output!r} has two formats, {chosen[output]} and {name}: "
            f"choose one, for example {output}={name}"
        )


def _nothing_for(name: str, outputs: tuple[str, ...], chosen: Mapping[str, str]) -> str:
    """Return the message about a format that no output gets."""
    reasons = [
        f"{output} ({FORMATS[name].refusal(output) or f'it is {chosen[output]}'})" for output in outputs
    ]
    can = [output for output in OUTPUTS if not FORMATS[name].refusal(output)]
    return (
        f"the format {name} is for none of the outputs: {', '.join(reasons)}; "
        f"leave it out, or ask for one of {', '.join(can)}"
    )


def _used(formats: _Pairs) -> set[str]:
    return {choice for output, name in formats for choice in FORMATS[name].choices_for(output)}


def _choices(formats: _Pairs, quality: int | None, depth_scale: float | None) -> Choices:
    """Return the numbers; raise an OutputError if one is out of range, or no file depends on it."""
    used = _used(formats)
    if quality is not None:
        whole = to_whole(quality)
        if whole is None or not 1 <= whole <= 100:
            raise OutputError(f"quality is a whole number from 1 to 100, got {quality!r}")
        if "quality" not in used:
            raise OutputError(
                f"quality is {whole}, but no output is WebP or JPEG: leave it out, or choose webp or jpeg"
            )
        quality = whole
    if depth_scale is None:
        return Choices(quality)
    low, high = _DEPTH_SCALES
    number = math.nan
    with suppress(TypeError, ValueError):
        number = float(depth_scale)
    if isinstance(depth_scale, bool) or not low <= number <= high:
        raise OutputError(f"depth_scale is a number from {low:g} to {high:g}, got {depth_scale!r}")
    if "depth_scale" not in used:
        raise OutputError(
            f"depth_scale is {number:g}, but no output 'depth' is png16: leave it out, or choose depth=png16"
        )
    return Choices(quality, number)
