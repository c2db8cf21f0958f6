"""Capture frames of scenes to files: what is asked for, who draws it, and how it ends."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

from firefly_sample.capture.datasets import find_dataset
from firefly_sample.capture.engine import Engine, HereEngine
from firefly_sample.capture.files import as_folder
from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.frames import frame_numbers, parse_shard
from firefly_sample.capture.job import Driver, Job
from firefly_sample.capture.journal import Asked
from firefly_sample.capture.manifest import Manifest
from firefly_sample.capture.one_file import OneFile, film_choices, is_one_file
from firefly_sample.capture.run import Run
from firefly_sample.capture.template import Template, check_same, parts_of
from firefly_sample.capture.views import Views, parse_views
from firefly_sample.capture.work import Share
from firefly_sample.encoding.formats import Encoding
from firefly_sample.errors import OutputError
from firefly_sample.frame import check_outputs
from firefly_sample.settings import Settings

log = logging.getLogger(__name__)


def capture_frames(
    scene: str = "forest",
    folder: str | Path | None = None,
    *,
    frames: str | int | range = "0:1",
    fps: float = 24.0,
    time: float | None = None,
    views: str | Views | None = None,
    size: tuple[int, int] = (800, 600),
    settings: Settings | None = None,
    outputs: Iterable[str] | None = None,
    formats: str | Iterable[str] | Mapping[str, str] | None = None,
    quality: int | None = None,
    depth_scale: float | None = None,
    crf: int | None = None,
    pad: bool = False,
    dataset: str | None = None,
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
        Made if need be; `default_folder` when absent. A path that ends like a film or a picture
        (``clip.mp4``, ``frame.png``: see `firefly_sample.capture.one_file`) becomes that one file.
    frames : str, int or range
        "FIRST:END" or "FIRST:END:STEP", END not included, or the number of one frame.
    fps : float
        Frames per second.
    time : float
        Seconds at frame 0: frame i shows ``time + i / fps``. When absent, the scene's `start_time`: 0 for
        model files, 5 for scenes that say nothing else.
    views : str or Views, optional
        The cameras that see each moment: "orbit:24" for 24 around the scene, or a JSON file of poses. With n
        views, frame ``n * i + k`` shows moment i from view k.
    size : (int, int)
        Width and height in pixels.
    settings : Settings, optional
        `capture_settings` of the outputs, with the scene's own settings, when absent. An exposure of "auto"
        is measured once, at the time of frame 0, whatever the range of frames.
    outputs : iterable of str, optional
        Names from `firefly_sample.frame.OUTPUTS`; when absent, those of the data set, or "color".
    formats : str, iterable of str, or mapping, optional
        The formats of the files: names for all outputs that they suit ("webp"), or for one ("depth=exr"); see
        `firefly_sample.encoding.formats.FORMATS`. Pictures are PNG and data ``.npz`` when absent.
    quality : int, optional
        1 to 100, of JPEG (95 when absent) and WebP (without loss when absent).
    depth_scale : float, optional
        Scene units of one code of a 16-bit depth; 0.001 when absent.
    crf : int, optional
        The quality of MP4 and WebM, 0 (without loss) to 51 or 63.
    pad : bool
        Enlarge a film's pictures to a size that its codec takes.
    dataset : str, optional
        Make a data set of it: "nerf", "bop" or "coco".
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
        Draw in this many processes of this machine; "auto" chooses as many as it has room for. When absent or
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
    from firefly_sample.scenes.plugin import scene_settings

    if resume and overwrite:
        raise OutputError("resume goes on with a capture and overwrite replaces it: choose one of them")
    seen = parse_views(views) if views is not None else None
    numbers = frame_numbers(frames, 1 if seen is None else len(seen))
    share = parse_shard(shard) if shard is not None else None
    if share is not None and overwrite:
        raise OutputError(
            "a shard cannot overwrite, because it would remove the files of others: empty the folder first, "
            "or use resume"
        )
    plugin = find_scene(scene)
    path = as_folder(folder) if folder is not None else default_folder(scene)
    names = check_outputs(outputs if outputs is not None else default_outputs(path, dataset))
    if settings is None:
        settings = capture_settings(names, **scene_settings(plugin))
    choices = film_choices(path, len(numbers), fps, crf, quality, pad)
    one = None
    if is_one_file(path):
        if sweep is not None or dataset is not None:
            what = "a sweep" if sweep is not None else f"the data set {dataset}"
            raise OutputError(f"{what} has many files, and {path} is one: name a folder")
        one = OneFile(path, numbers, choices)
        formats, path = one.formats(names, formats), one.folder
    encoding = Encoding.of(
        names,
        formats,
        quality if choices is None else None,
        depth_scale,
        find_dataset(dataset).formats if dataset is not None else None,
    )
    encoding.require()
    template = Template(
        plugin=plugin,
        scene=scene,
        size=size,
        settings=settings,
        outputs=names,
        encoding=encoding,
        dataset=dataset,
        fps=fps,
        time=time,
        views=seen,
        parameters=parameters,
        device=device,
        require_gpu=require_gpu,
    )
    jobs = list(template.jobs(sweep))
    if dataset is not None:
        find_dataset(dataset).check(names, dict(encoding.formats))
        find_dataset(dataset).require()
    if one is not None:
        one.check(jobs[0])
    if share is not None and not resume and share.number > len(jobs) * len(numbers):
        # the others may have finished the capture already, because they need not wait for this one
        log.info("there are fewer frames than shards: shard %s has none", share)
        return Share(0, 0)
    asked: Asked = {
        "frames": (numbers.moments.start, numbers.moments.stop, numbers.moments.step),
        "views": numbers.views,
        "jobs": len(jobs),
        "shard": str(share or ""),
    }
    with CaptureFolder(path, asked, share, overwrite, dataset) as place:
        finished = None
        if one is not None:
            if share is None:
                one.remove_parts()
            if resume:
                finished = one.finished(jobs[0])
        if finished is not None:
            result: Manifest | Share = finished
        else:
            if not (resume or overwrite):
                place.check_free()
                if one is not None:
                    one.check_free()
            count = len(jobs) * len(numbers)
            engine = _engine(jobs[0], count, workers, cluster, place.records.driver())
            with engine:
                parts = parts_of(place, template, jobs, engine.driver)
                alike = asked if share is not None and not resume else None
                if alike is not None:
                    check_same(place, parts, alike)
                result = Run(place, parts, numbers, engine, fail_fast, alike, progress).finish()
            if one is not None and isinstance(result, Manifest):
                result = one.bind(result, progress)
    if one is not None and isinstance(result, Manifest) and "file" in result:
        one.remove_folder()
    return result


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
    return HereEngine(job) if count == 1 else ProcessEngine(job, count, auto=workers == "auto")


def capture_settings(outputs: Iterable[str], **changes: Any) -> Settings:
    """Return the settings to capture `outputs` with: supersampled if all are color or color_alpha.

    `changes` are as in `Settings.with_changes`.
    """
    supersample = 2 if {"color", "color_alpha"}.issuperset(outputs) else 1
    return Settings().with_changes(**({"supersample": supersample} | changes))


def default_outputs(folder: Path | None, dataset: str | None) -> tuple[str, ...]:
    """Return the outputs of a capture that names none: those of its data set, or what its file can hold."""
    if dataset is not None:
        return find_dataset(dataset).outputs
    suffix = folder.suffix.lower() if folder is not None and is_one_file(folder) else ""
    return {".exr": ("radiance",), ".npz": ("depth",)}.get(suffix, ("color",))


def default_folder(scene: str) -> Path:
    """Return the default folder for the frames of a scene: ``captures/<its name>``; of files, their stems."""
    from firefly_sample.scenes import find_scene
    from firefly_sample.scenes.plugin import folder_name

    return Path("captures") / folder_name(find_scene(scene))
