"""Draw the frames of jobs in this process, and encode them as the bytes of files."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

from firefly_sample.capture.datasets import find_dataset
from firefly_sample.capture.datasets.annotations import draw_annotated, is_annotated
from firefly_sample.capture.drawn import Drawn, Failed, Sight, as_drawn, encode, encode_masks
from firefly_sample.capture.job import Driver, Job, Task
from firefly_sample.capture.viewed_scene import ViewedScene
from firefly_sample.errors import FireflyError, SoftwareDriverWarning
from firefly_sample.settings import to_number

if TYPE_CHECKING:
    from firefly_sample.scene.scene import Scene, ScenePlugin

_OF_SCENES = (Exception, SystemExit, GeneratorExit)
"""Exceptions that count as errors of the scene: they make its frame a failed one."""


class Artist:
    """A renderer, and the scene of the job that was drawn last. A context manager.

    Parameters
    ----------
    job : Job
        One of those that are going to be drawn. All have the same size, outputs and device.

    Raises
    ------
    FireflyError
        If there is no driver, or it cannot draw pictures of this size.
    """

    def __init__(self, job: Job) -> None:
        from firefly_sample.renderer import Renderer

        self._renderer = Renderer(job.size, job.exposed, device=job.device, require_gpu=job.require_gpu)
        self._job: Job | None = None
        self._scene: Scene | FireflyError | None = None
        self._plugin: ScenePlugin | None = None

    @property
    def driver(self) -> Driver:
        """The driver of all frames."""
        return Driver(self._renderer.driver, self._renderer.driver_version, self._renderer.software)

    @property
    def exposure(self) -> float:
        """The exposure of the job that was drawn last, as a number."""
        return to_number(self._renderer.settings.exposure)

    def draw_one(self, task: Task) -> Drawn | Failed:
        """Draw and encode one frame. What is warned of meanwhile is kept in the result."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            warnings.simplefilter("ignore", SoftwareDriverWarning)
            ((_, sight),) = self.draw([task])
        said = tuple(dict.fromkeys(str(one.message) for one in caught))
        if isinstance(sight, Failed):
            return replace(sight, said=said)
        encoding = task.job.encoding
        try:
            encoded = {key: encode(encoding, key, sight.frame.images) for key in encoding.files()}
        except FireflyError as error:
            return Failed(task.index, error, said=said)
        if sight.annotations is not None:
            encoded |= encode_masks(sight.annotations.masks)
        return as_drawn(task, sight, encoded, said)

    def draw(self, tasks: Iterable[Task]) -> Iterator[tuple[Task, Sight | Failed]]:
        """Draw frames in the given order; each is read back while the next one is drawn.

        A frame that cannot be drawn is given as `Failed`, and those after it are drawn all the same.
        """
        todo = _Queue(tasks)
        while (first := todo.first()) is not None:
            scene = self._scene_of(first.job)
            if isinstance(scene, FireflyError):
                yield todo.take(), Failed(first.index, scene, whole_job=True)
                continue
            drawing: deque[Task] = deque()
            times = _times(first.job, scene, todo, drawing)
            sights = self._sights(first.job, scene, times)
            while True:
                result: Sight | Failed
                try:
                    result = next(sights)
                except StopIteration:
                    break
                except MemoryError:
                    raise
                except _OF_SCENES as error:
                    if not drawing:
                        raise  # the list of tasks is wrong, and no frame
                    result = Failed(drawing[0].index, self._as_firefly_error(error))
                yield drawing.popleft(), result
                del result
            todo.put_back(drawing)  # those that had begun when one of them failed

    def _sights(self, job: Job, scene: Scene, times: Iterable[float]) -> Iterator[Sight]:
        """Draw a scene at each of some times, with what the job's data set needs to know of it."""
        dataset = job.dataset
        if dataset is None or not is_annotated(dataset):
            for frame in self._renderer.render_many(scene, times, job.outputs):
                if dataset is not None:
                    find_dataset(dataset).check_lens(frame.camera.intrinsics)
                yield Sight(frame, self.exposure)
            return
        for time in times:  # the scene must be as it was drawn while its instances are found
            frame, annotations = draw_annotated(self._renderer, scene, time, job.outputs, dataset)
            find_dataset(dataset).check_lens(frame.camera.intrinsics)  # a scene may change it with time
            yield Sight(frame, self.exposure, annotations)

    def _scene_of(self, job: Job) -> Scene | FireflyError:
        """Return the scene of a job, or the error that keeps it from being built; the last is kept."""
        from firefly_sample.plan.exposure import with_exposure_at
        from firefly_sample.scenes import build_scene, find_scene

        if self._scene is None or job != self._job:
            self._job, self._scene = None, None  # the scene before is freed before another one is built
            try:
                self._plugin = find_scene(job.scene)
                self._scene = build_scene(self._plugin, **job.parameters)
                exposed = with_exposure_at(self._scene, job.exposed, job.start)
                if job.views is not None:
                    self._scene = ViewedScene(self._scene, job.views, job.size, job.start)
                if job.dataset is not None:
                    _check_lenses(self._scene, job.dataset)
                self._renderer.settings = exposed
            except MemoryError:
                raise
            except _OF_SCENES as error:
                self._scene = self._as_firefly_error(error)
            self._job = job
        return self._scene

    def _as_firefly_error(self, error: BaseException) -> FireflyError:
        from firefly_sample.scenes import scene_error

        if isinstance(error, FireflyError):
            return error
        scene = self._scene.scene if isinstance(self._scene, ViewedScene) else self._scene
        modules = {type(scene).__module__}
        named: FireflyError | None = None
        if self._plugin is not None:
            named = scene_error(self._plugin, error, modules)
        if named is None:
            named = FireflyError(f"{type(error).__name__}: {' '.join(str(error).split())}")
        named.__cause__ = error
        return named

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.close()

    def __enter__(self) -> Artist:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Queue:
    """Tasks that are taken one by one from an iterable, and can be put back."""

    def __init__(self, tasks: Iterable[Task]) -> None:
        self._tasks = iter(tasks)
        self._front: deque[Task] = deque()

    def first(self) -> Task | None:
        """Return the next task, which stays, or None at the end."""
        if not self._front:
            self._front.extend(islice(self._tasks, 1))
        return self._front[0] if self._front else None

    def take(self) -> Task:
        """Take the task that `first` returned."""
        return self._front.popleft()

    def put_back(self, tasks: Iterable[Task]) -> None:
        """Put tasks before the next one, in their order."""
        self._front.extendleft(reversed(list(tasks)))


def _times(job: Job, scene: Scene, todo: _Queue, drawing: deque[Task]) -> Iterator[float]:
    """Take the tasks of a job up to the first of another one; put each in `drawing`, and give its time.

    The scene is seen from each frame's view, because a frame is planned as soon as its time is given.
    """
    while (task := todo.first()) is not None and (task.job is job or task.job == job):
        drawing.append(todo.take())
        view = job.view(task.index)
        if view is not None and isinstance(scene, ViewedScene):
            scene.view = view
        yield job.time(task.index)


def _check_lenses(scene: Scene, dataset: str) -> None:
    """Raise an OutputError if a data set cannot describe a camera of a scene."""
    for lens in scene.lenses() if isinstance(scene, ViewedScene) else [scene.lens]:
        find_dataset(dataset).check_lens(lens)
