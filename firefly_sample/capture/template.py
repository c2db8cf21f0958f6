"""The jobs of a capture: those that are asked for, and those of earlier runs in its folder."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.frames import asked_numbers, check_clock
from firefly_sample.capture.job import Driver, Job, differences
from firefly_sample.capture.journal import Asked
from firefly_sample.capture.sources import hash_sources
from firefly_sample.capture.views import Views
from firefly_sample.capture.work import Part
from firefly_sample.encoding.formats import Encoding
from firefly_sample.errors import OutputError
from firefly_sample.frame import check_outputs, check_size
from firefly_sample.settings import Settings

if TYPE_CHECKING:
    from firefly_sample.scene.scene import ScenePlugin


class Template:
    """What all jobs of a capture have in common; the arguments are those of `capture_frames`."""

    def __init__(
        self,
        plugin: ScenePlugin,
        scene: str,
        size: tuple[int, int],
        settings: Settings,
        outputs: tuple[str, ...],
        encoding: Encoding,
        dataset: str | None,
        fps: float,
        time: float | None,
        views: Views | None,
        parameters: Mapping[str, Any] | None,
        device: int | None,
        require_gpu: bool,
    ) -> None:
        from firefly_sample.scenes.plugin import start_time

        start = start_time(plugin) if time is None else time
        check_clock(fps, start)
        self._plugin = plugin
        self._parameters = dict(parameters or {})
        self._hashes: dict[str, str] = {}
        self._first = Job(
            scene=scene,
            parameters={},
            settings=settings,
            exposure=None,
            size=check_size(size),
            outputs=outputs,
            fps=float(fps),
            start=float(start),
            views=views,
            encoding=encoding,
            dataset=dataset,
            device=device,
            require_gpu=require_gpu,
        )

    def jobs(self, sweep: Mapping[str, Any] | Iterable[str] | None) -> Iterator[Job]:
        """Yield the job of each combination of a sweep; one without a sweep."""
        if sweep is None:
            yield self.job({})
            return
        from firefly_sample.capture.sweep import combinations, parse_sweep

        for values in combinations(parse_sweep(sweep, self._plugin)):
            yield self.job(values)

    def job(self, values: Mapping[str, Any]) -> Job:
        """Return the job with these values of a sweep."""
        from firefly_sample.scene.parameter import resolve_parameters

        settings, given, folder = self._first.settings, self._parameters, ""
        if values:
            from firefly_sample.capture.sweep import apply, folder_of

            settings, given = apply(values, settings, given, self._plugin)
            folder = folder_of(values)
        check_outputs(self._first.outputs, settings.supersample)
        resolved = resolve_parameters(self._plugin.name, self._plugin.parameters, given)
        return replace(
            self._first,
            parameters=resolved,
            settings=settings,
            exposure=None if isinstance(settings.exposure, str) else settings.exposure,
            sources=hash_sources(resolved, self._hashes),
            folder=folder,
            values=dict(values),
        )


def parts_of(folder: CaptureFolder, template: Template, jobs: Sequence[Job], driver: Driver) -> list[Part]:
    """Return the parts that are asked for, and those of earlier runs in the folder."""
    records = folder.records
    parts = [Part(job, driver, place) for place, job in enumerate(jobs)]
    asked = {part.job.folder for part in parts}
    names, scene = list(jobs[0].values), jobs[0].scene
    for description in records.descriptions.values():
        if description["scene"] != scene:
            raise OutputError(
                f"in {folder.path} there is a capture of scene {description['scene']!r}, not of {scene!r}: "
                "choose another folder, or use --overwrite"
            )
    for other in sorted(set(records.folders()) - asked):
        latest = next(records.indices(other))
        values = records.descriptions[records.frame(other, latest)["about"]]["values"]
        if list(values) != names:
            before = f"a sweep over {', '.join(values)}" if values else "a capture without a sweep"
            raise OutputError(
                f"in {folder.path} there is {before}, and --resume needs the same --sweep names: "
                "choose another folder, or use --overwrite"
            )
        parts.append(Part(template.job(values), driver, None))
    take_exposures(folder, parts)
    return parts


def take_exposures(folder: CaptureFolder, parts: Sequence[Part]) -> None:
    """Give the parts the exposures that were measured for them before, or by other shards."""
    for part in parts:
        known = folder.records.descriptions.get(part.key)
        if known is not None and part.description["exposure"] is None and known["exposure"] is not None:
            part.expose(known["exposure"])
            part.job = replace(part.job, exposure=known["exposure"])


def check_same(folder: CaptureFolder, parts: Sequence[Part], asked: Asked) -> None:
    """Raise an OutputError if other shards are asked for other frames, or drawn with other settings."""
    by_folder = {part.job.folder: part for part in parts}
    changed: list[str] = []
    for other in folder.records.asked:
        before, now = asked_numbers(other), asked_numbers(asked)
        if before != now:
            changed.append(f"frames: {before}, now {now}")
        elif other["jobs"] != asked["jobs"]:
            changed.append(f"combinations: {other['jobs']}, now {asked['jobs']}")
    for key, description in folder.records.descriptions.items():
        part = by_folder.get(description["folder"])
        if part is None:
            changed.append(f"a folder {description['folder']!r}")
        elif key != part.key:
            changed += differences(description, part.description)
    if changed:
        raise OutputError(
            f"other shards of the capture in {folder.path} are drawn with other settings "
            f"({'; '.join(dict.fromkeys(changed))}): use the same ones, or another folder"
        )
