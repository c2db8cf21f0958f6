"""``firefly verify``: compare a capture with its manifest, or with another capture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import CycloptsError, Parameter, Token

from firefly_sample.columns import align
from firefly_sample.commands.options import Flag, Folder
from firefly_sample.commands.terminal import print_json, print_result, progress_bar

if TYPE_CHECKING:
    from firefly_sample.capture.checking.report import Problem, Report

MOST_LINES = 20
"""More problems than this are counted, and listed only by --json."""


def _number(most: float, what: str) -> Callable[[Any, Sequence[Token]], float]:
    """Return a converter of a number from 0 to `most`; NaN is none."""

    def convert(_: Any, tokens: Sequence[Token]) -> float:
        text = tokens[0].value
        try:
            number = float(text)
        except ValueError:
            number = -1.0
        if not 0.0 <= number <= most:
            raise ValueError(f"it must be {what}, got {text!r}")
        return number

    return convert


def _limit(metavar: str, most: float, what: str) -> Parameter:
    return Parameter(
        metavar=metavar,
        converter=_number(most, what),
        n_tokens=1,
        allow_leading_hyphen=True,
        show_default=lambda number: f"{number:g}",
    )


def _to_capture(_: Any, tokens: Sequence[Token]) -> Path:
    text = tokens[0].value
    if not text.strip() or "\0" in text:
        raise ValueError(f"it must name a folder, got {text!r}; the working folder is '.'")
    return Path(text)


def verify(
    folder: Annotated[Path, Parameter(metavar="FOLDER", converter=_to_capture, n_tokens=1)],
    other: Annotated[Path | None, Parameter(metavar="OTHER", converter=_to_capture, n_tokens=1)] = None,
    /,
    *,
    max_codes: Annotated[float, _limit("N", 255.0, "a number from 0 to 255")] = 0.0,
    max_error: Annotated[float, _limit("E", 1e300, "a number, 0 or more")] = 0.0,
    max_share: Annotated[float, _limit("SHARE", 1.0, "a share from 0 to 1")] = 0.0,
    differences: Folder | None = None,
    merge: Flag = False,
    json: Flag = False,
    quiet: Annotated[Flag, Parameter(name=["--quiet", "-q"])] = False,
) -> int:
    """Check that a capture is whole, or compare it with another one.

    With one folder, each file is compared with manifest.json: it must be there, and hold the pixels that
    were drawn. With two folders, the images of OTHER are compared with those of FOLDER, which are the
    expected ones. They must be equal unless you set limits. A film is given by its name, clip.mp4.

    The exit code is 0 if all is as it should be, and 1 if not.

    Parameters
    ----------
    folder
        The folder of a capture or of a sweep, or a film.
    other
        The capture to compare with it.
    max_codes
        Pixels of 8-bit pictures may differ by this many codes (0 to 255).
    max_error
        Pixels of float images may differ by this share of the expected image's 99.9th percentile.
    max_share
        This share of a picture's pixels may be over these limits, for example 0.001; of ids, may be unequal.
    differences
        Folder for a picture of each difference: expected, actual and difference side by side.
    merge
        First write the manifest of a capture whose shards are all drawn.
    json
        Print the whole report as JSON.
    quiet
        Print nothing if all is well, and no progress bar.
    """
    from firefly_sample.capture.verify import compare_captures, verify_capture

    if other is None:
        for name, value in (
            ("--max-codes", max_codes),
            ("--max-error", max_error),
            ("--max-share", max_share),
            ("--differences", differences),
        ):
            if value:
                raise CycloptsError(f"{name} compares two captures: give two folders")
    elif merge:
        raise CycloptsError("--merge takes one folder: leave the other one out")
    if merge:
        from firefly_sample.capture.merge import merge_capture

        merge_capture(folder)
    with progress_bar("frames", show=not quiet) as progress:
        if other is None:
            report = verify_capture(folder, progress)
        else:
            report = compare_captures(
                folder,
                other,
                max_codes=max_codes,
                max_error=max_error,
                max_share=max_share,
                differences=differences,
                progress=progress,
            )
    if json:
        print_json(report.as_dict())
    elif not (quiet and report.ok):
        print_result(report_as_text(report, differences))
    return int(not report.ok)


def report_as_text(report: Report, differences: Path | None = None) -> str:
    """Return a report as lines: notes, problems, a table of images that differ, and a summary."""
    shown, more = report.problems[:MOST_LINES], len(report.problems) - MOST_LINES
    lines = [f"note: {note.text}" for note in report.notes]
    lines += [problem.text for problem in shown if problem.figures is None]
    different = [problem for problem in shown if problem.figures is not None]
    if different:
        lines.append(align([_head(different), *(_row(problem, different) for problem in different)]))
    if more > 0:
        lines.append(f"and {more:,} more, which --json lists")
    pictures = sum(problem.picture is not None for problem in report.problems)
    if pictures:
        lines.append(f"{_count(pictures, 'picture')} of differences in {differences}")
    return "\n".join([*lines, _summary(report)])


def _head(different: list[Problem]) -> tuple[str, ...]:
    return ("FRAME", "OUTPUT", "PIXELS", "LARGEST", "MEAN", *_picture_cell(different, "PICTURE"))


def _picture_cell(different: list[Problem], text: str | None) -> tuple[str, ...]:
    return (text or "",) if any(problem.picture for problem in different) else ()


def _row(problem: Problem, different: list[Problem]) -> tuple[str, ...]:
    figures = problem.figures or {}
    share = 100.0 * figures["pixels"] / max(figures["of"], 1)
    percent = f"{share:.0f}" if share >= 9.95 else f"{share:.2g}"
    return (
        f"{problem.capture}/{problem.frame}" if problem.capture else str(problem.frame),
        str(problem.output),
        f"{figures['pixels']:,} ({percent} %)",
        *(_size(figures[name], figures["scale"]) for name in ("largest", "mean")),
        *_picture_cell(different, problem.picture and Path(problem.picture).name),
    )


def _size(value: float | None, scale: float | None) -> str:
    """Return a difference as its limit counts it: in codes, or divided by the scale of a float image."""
    if value is None:
        return "-"
    if scale is None:
        return f"{value:.3g}"
    return f"{value / scale:.1e}" if scale and value < float("inf") else f"{value:g}"


def _summary(report: Report) -> str:
    frames, files = _count(report.frames, "frame"), _count(report.files, "file")
    problems = _count(len(report.problems), "problem")
    if report.other is None:
        if report.ok:
            return f"{report.folder} is whole: {frames}, {files}"
        return f"{report.folder} is not whole: {problems} in {frames}"
    names = f"{report.folder} and {report.other}"
    limits = report.limits
    held = "" if limits is None else _limits(limits.max_codes, limits.max_error, limits.max_share)
    if report.ok:
        return f"{names} are the same{held}: {frames}"
    return f"{names} differ{held}: {problems} in {frames}"


def _limits(max_codes: float, max_error: float, max_share: float) -> str:
    """Return the limits for the summary, those that are not 0."""
    parts = [
        f"{max_codes:g} code{'' if max_codes == 1 else 's'}" if max_codes else "",
        f"error {max_error:g}" if max_error else "",
        f"{100.0 * max_share:g} % of pixels" if max_share else "",
    ]
    text = ", ".join(filter(None, parts))
    return f" (limits: {text})" if text else ""


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
