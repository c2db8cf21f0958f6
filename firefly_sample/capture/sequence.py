"""Capture frames of scenes to files: what is asked for, who draws it, and how it ends."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from firefly_sample.capture.closing import write_records
from firefly_sample.capture.drawing import Failed
from firefly_sample.capture.engine import Engine, HereEngine
from firefly_sample.capture.files import as_folder
from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.frames import check_clock, parse_frames, parse_shard
from firefly_sample.capture.job import Driver, Job, Task, differences
from firefly_sample.capture.journal import Asked
from firefly_sample.capture.manifest import Manifest, read_manifest
from firefly_sample.capture.sources import hash_sources
from firefly_sample.capture.work import Part, Share, Work
from firefly_sample.capture.writer import FrameWriter
from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.frame import check_outputs, check_size
from firefly_sample.settings import Settings

if TYPE_CHECKING:
    from firefly_sample.scene.scene import ScenePlugin

log = logging.getLogger(__name__)
_ROUNDS = 3
"""How often files that are not as they were written are drawn again at the end."""
_TOLD = 5
"""Failed frames of which a warning tells; the manifest has all of them."""


def capture_frames(
    scene: str = "forest",
    folder: str | Path | None = None,
    *,
    frames: str | int | range = "0:1",
    fps: float = 24.0,
    time: float | None = None,
    size: tuple[int, int] = (800, 600),
    settings: Settings | None = None,
    outputs: Iterable[str] = ("color",),
    parameters: Mapping[str, Any] | None = None,
    sweep: Mapping[str, Any] | Iterable[str] | None = None,
    resume: bool = False,
    overwrite: bool = False,
    fail_fast: bool = False,
    workers: int | Literal["auto"] | None = None,
    cluster: str | None = None,
    shard: str | tuple[int, int] | None = None,
    device: int | None = None,
    require_gpu: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Manifest | Share:
    """Render frames of a scene into files, and describe them in ``manifest.json``.

    Every file is written whole or not at all, and a frame is recorded in a journal when its files are on the
    disk. The manifest comes last, after all files have been read and compared with their hashes. A capture
    that was interrupted, killed, or ran out of disk, goes on with `resume`, and ends with the same bytes.

    Parameters
    ----------
    scene : str
        Name of a scene plugin, "package.module:object", or a model's file: see `find_scene`.
    folder : path, optional
        Made if need be; `default_folder` when absent.
    frames : str, int or range
        "FIRST:END" or "FIRST:END:STEP", END not included, or the number of one frame.
    fps : float
        Frames per second.
    time : float
        Seconds at frame 0: frame i shows ``time + i / fps``. When absent, the scene's `start_time`: 0 for
        model files, 5 for scenes that say nothing else.
    size : (int, int)
        Width and height in pixels.
    settings : Settings, optional
        `capture_settings` of the outputs, with the scene's own settings, when absent. An exposure of "auto"
        is measured once, at the time of frame 0, whatever the range of frames.
    outputs : iterable of str
        Names from `firefly_sample.frame.OUTPUTS`; pictures become PNG, data ``.npz``.
    parameters : mapping, optional
        The scene's parameters; those left out have their defaults.
    sweep : mapping, or iterable of str, optional
        Parameters and settings with several values each, for example ``{"fireflies": [100, 200]}`` or
        ``["fireflies=100,200"]``: see `firefly_sample.capture.sweep.parse_sweep`. Every combination is
        captured into a folder of its own, and one manifest describes them all.
    resume : bool
        Go on with the capture in the folder: draw the frames that are missing, damaged, failed or of other
        settings, and keep those that are whole, also others than `frames`.
    overwrite : bool
        Replace the capture in the folder, when the first frame has been drawn.
    fail_fast : bool
        Stop at the first frame that cannot be drawn. Otherwise the others are drawn, and the manifest names
        it in "failed".
    workers : int or "auto", optional
        Draw in so many processes of this machine; "auto" chooses as many as it has room for. When absent or
        1, this process draws.
    cluster : str, optional
        Draw on a cluster of dask.distributed: the address of its scheduler, or "local" for one on this
        machine with as many processes as `workers` says.
    shard : str or (int, int), optional
        Draw only a share, "2/8" for the second of eight; other processes draw the others into the same
        folder. The last one writes the manifest.
    device, require_gpu : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (whole frames, frames in all), first with those that are whole already.

    Returns
    -------
    Manifest or Share
        The content of ``manifest.json``; a Share if other shards have yet to be drawn, or this one has no
        frame.

    Warns
    -----
    UserWarning
        Once for each warning of a frame, for example on blended materials that are drawn as cut-outs; for the
        first frames that fail; and for a software driver.

    Raises
    ------
    FireflyError
        If the scene, a parameter, the frames, the size, an output, the folder or the driver is wrong, if the
        folder has another capture, or if no frame at all can be drawn. A new folder is removed again if it is
        empty.
    """
    from firefly_sample.scenes import find_scene

    if resume and overwrite:
        raise OutputError("resume goes on with a capture and overwrite replaces it: choose one of them")
    numbers = parse_frames(frames)
    share = parse_shard(shard) if shard is not None else None
    if share is not None and overwrite:
        raise OutputError(
            "a shard cannot overwrite, because it would remove the files of others: empty the folder first, "
            "or use resume"
        )
    plugin = find_scene(scene)
    template = _Template(plugin, scene, size, settings, outputs, fps, time, parameters, device, require_gpu)
    jobs = list(template.jobs(sweep))
    path = as_folder(folder) if folder is not None else default_folder(scene)
    if share is not None and not resume and share.number > len(jobs) * len(numbers):
        # the others may have finished the capture already, because they need not wait for this one
        log.info("there are fewer frames than shards: shard %s has none", share)
        return Share(0, 0)
    asked: Asked = {
        "frames": (numbers.start, numbers.stop, numbers.step),
        "jobs": len(jobs),
        "shard": str(share or ""),
    }
    with CaptureFolder(path, asked, share, overwrite) as place:
        if not (resume or overwrite):
            place.check_free()
        count = len(jobs) * len(numbers)
        engine = _engine(jobs[0], count, workers, cluster, place.records.driver())
        with engine:
            parts = _parts(place, template, jobs, engine)
            alike = asked if share is not None and not resume else None
            if alike is not None:
                _check_same(place, parts, alike)
            return _Capture(place, parts, numbers, engine, fail_fast, alike, progress).run()


class _Template:
    """What all jobs of a capture have in common."""

    def __init__(
        self,
        plugin: ScenePlugin,
        scene: str,
        size: tuple[int, int],
        settings: Settings | None,
        outputs: Iterable[str],
        fps: float,
        time: float | None,
        parameters: Mapping[str, Any] | None,
        device: int | None,
        require_gpu: bool,
    ) -> None:
        from firefly_sample.scenes.plugin import scene_settings, start_time

        names = check_outputs(outputs)
        if settings is None:
            settings = capture_settings(names, **scene_settings(plugin))
        start = start_time(plugin) if time is None else time
        check_clock(fps, start)
        self._plugin = plugin
        self._parameters = dict(parameters or {})
        self._first = Job(
            scene=scene,
            parameters={},
            settings=settings,
            exposure=None,
            size=check_size(size),
            outputs=names,
            fps=float(fps),
            start=float(start),
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
            sources=hash_sources(resolved),
            folder=folder,
            values=dict(values),
        )


class _Capture:
    """A capture that is under way. With `alike` it is an error if other shards were asked for another one."""

    def __init__(
        self,
        folder: CaptureFolder,
        parts: list[Part],
        frames: range,
        engine: Engine,
        fail_fast: bool,
        alike: Asked | None,
        progress: Callable[[int, int], None] | None,
    ) -> None:
        self._folder, self._engine, self._fail_fast, self._alike = folder, engine, fail_fast, alike
        self._parts = parts
        self._by_folder = {part.job.folder: part for part in self._parts}
        self._work = Work(folder, self._parts, frames)
        self._report = progress or (lambda done, total: None)
        self._done = self._total = 0
        self._failures: list[tuple[Task, Failed]] = []
        self._said: set[str] = set()

    def run(self) -> Manifest | Share:
        """Draw what has to be drawn, check everything, and write the manifest if all shards are done."""
        survey = self._work.check(retry=True)
        if survey.whole or survey.wrong:
            log.info("%s", survey)
        try:
            self._draw()
            return self._finish()
        except BaseException:
            recorded = self._work.count()[0]
            if recorded:
                log.warning(
                    "%d of %d frames are whole in %s; to go on, use --resume",
                    recorded,
                    max(self._total, recorded),
                    self._folder.path,
                )
            raise

    def _draw(self) -> None:
        """Draw the frames that are missing."""
        self._done, self._total = self._work.count()
        self._report(self._done, self._total)
        if self._done == self._total:
            return
        with FrameWriter(self._folder) as writer:
            for task, drawn in self._engine.draw(self._work.missing()):
                self._say(drawn.said)
                if isinstance(drawn, Failed):
                    self._fail(task, drawn)
                    continue
                part = self._by_folder[task.job.folder]
                part.expose(drawn.exposure)
                self._say(drawn.warnings)
                self._advance(writer.put(part, drawn))
            self._advance(writer.finish())
        if self._failures and not self._done and self._folder.shard is None:
            raise self._failures[0][1].error
        for task, failed in self._failures:
            self._record_failure(task, failed)
        self._failures.clear()

    def _advance(self, count: int) -> None:
        for _ in range(count):
            self._done += 1
            self._report(self._done, self._total)

    def _say(self, texts: Iterable[str]) -> None:
        for text in texts:
            if text not in self._said:
                self._said.add(text)
                warnings.warn(text, stacklevel=5)

    def _fail(self, task: Task, failed: Failed) -> None:
        """Keep a failure until a frame is whole: a capture of which none can be drawn changes nothing."""
        error = failed.error
        if self._fail_fast or (failed.whole_job and len(self._parts) == 1):
            raise error if failed.whole_job else type(error)(f"frame {failed.index}: {error}") from error
        told = len(self._failures)
        if told < _TOLD:
            where = f" of {task.job.folder}" if task.job.folder else ""
            warnings.warn(f"frame {failed.index}{where} cannot be drawn: {error}", stacklevel=4)
        self._failures.append((task, failed))

    def _record_failure(self, task: Task, failed: Failed) -> None:
        frame = {"index": failed.index, "time": task.job.time(failed.index), "error": str(failed.error)}
        self._folder.add(self._by_folder[task.job.folder].description, frame)

    def _finish(self) -> Manifest | Share:
        """Check all files, draw again those that are not as they were written, and write the manifest."""
        everything = self._folder.shard is not None
        if everything:
            if not self._folder.become_alone():
                log.info("other shards are being drawn: the last one writes the manifest")
                return self._work.share()
            self._folder.reread()
            if self._alike is not None:
                _check_same(self._folder, self._parts, self._alike)
            _take_exposures(self._folder, self._parts)
            others = self._work.count_others()
            if others:
                log.info("there is no manifest yet: frames of other shards have yet to be drawn (%d)", others)
                return self._work.share()
        for _ in range(_ROUNDS):
            survey = self._work.check(everything)
            if not survey.wrong:
                break
            log.warning("files were changed while others were drawn: %s", survey)
            self._draw()
        else:
            raise FireflyError(f"files in {self._folder.path} are changed by another program all the time")
        self._folder.remove_strays(self._parts[0].job.outputs)
        descriptions = [part.description for part in self._parts]
        write_records(self._folder.path, self._folder.records, descriptions)
        self._folder.end()
        return read_manifest(self._folder.path)


def _parts(folder: CaptureFolder, template: _Template, jobs: Sequence[Job], engine: Engine) -> list[Part]:
    """Return the parts that are asked for, and those of earlier runs in the folder."""
    records, driver = folder.records, engine.driver
    parts = [Part(job, driver, place) for place, job in enumerate(jobs)]
    asked = {part.job.folder for part in parts}
    names = list(jobs[0].values)
    for other in sorted(set(records.folders()) - asked):
        latest = next(records.indices(other))
        values = records.descriptions[records.frame(other, latest)["about"]]["values"]
        if list(values) != names:
            before = f"a sweep over {', '.join(values)}" if values else "a capture without a sweep"
            raise OutputError(
                f"in {folder.path} there is {before}, which cannot be gone on with in this way: choose "
                "another folder, or use --overwrite"
            )
        parts.append(Part(template.job(values), driver, None))
    _take_exposures(folder, parts)
    return parts


def _take_exposures(folder: CaptureFolder, parts: Sequence[Part]) -> None:
    """Give the parts the exposures that were measured for them before, or by other shards."""
    for part in parts:
        known = folder.records.descriptions.get(part.key)
        if known is not None and part.description["exposure"] is None and known["exposure"] is not None:
            part.expose(known["exposure"])
            part.job = replace(part.job, exposure=known["exposure"])


def _check_same(folder: CaptureFolder, parts: Sequence[Part], asked: Asked) -> None:
    """Raise an OutputError if other shards are asked for other frames, or drawn with other settings."""
    by_folder = {part.job.folder: part for part in parts}
    changed: list[str] = []
    for other in folder.records.asked:
        if tuple(other["frames"]) != asked["frames"]:
            before, now = (":".join(map(str, each["frames"])) for each in (other, asked))
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


def _engine(
    job: Job,
    frames: int,
    workers: int | Literal["auto"] | None,
    cluster: str | None,
    earlier: Driver | None,
) -> Engine:
    """Return what draws; on a cluster only workers with the driver of `earlier` frames do."""
    if cluster is not None:
        from firefly_sample.capture.cluster import ClusterEngine

        return ClusterEngine(job, cluster, workers, earlier)
    if workers is None:
        return HereEngine(job)
    from firefly_sample.capture.processes import ProcessEngine, choose_workers

    count = choose_workers(workers, frames)
    return HereEngine(job) if count == 1 else ProcessEngine(job, count)


def capture_settings(outputs: Iterable[str], **changes: Any) -> Settings:
    """Return the settings to capture `outputs` with: supersampled if all are color or color_alpha.

    `changes` are as in `Settings.with_changes`.
    """
    supersample = 2 if {"color", "color_alpha"}.issuperset(outputs) else 1
    return Settings().with_changes(**({"supersample": supersample} | changes))


def default_folder(scene: str) -> Path:
    """Return the default folder for the frames of a scene: ``captures/<its name>``; of files, their stems."""
    from firefly_sample.scenes import find_scene
    from firefly_sample.scenes.plugin import folder_name

    return Path("captures") / folder_name(find_scene(scene))
