"""A capture that is under way: frames are drawn, written, checked, and described by the manifest."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterable

from firefly_sample.capture.closing import write_records
from firefly_sample.capture.drawn import Failed
from firefly_sample.capture.engine import Engine
from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.frames import FrameNumbers
from firefly_sample.capture.job import Task
from firefly_sample.capture.journal import Asked
from firefly_sample.capture.manifest import Manifest, read_manifest
from firefly_sample.capture.template import check_same, take_exposures
from firefly_sample.capture.work import Part, Share, Work
from firefly_sample.capture.writer import FrameWriter
from firefly_sample.errors import FireflyError, SceneError

log = logging.getLogger(__name__)
_ROUNDS = 3
"""How often files that are not as they were written are drawn again at the end."""
_TOLD = 5
"""Failed frames of which a warning tells; the manifest has all of them."""


class Run:
    """A capture that is under way. With `alike` it is an error if other shards were asked for another one."""

    def __init__(
        self,
        folder: CaptureFolder,
        parts: list[Part],
        frames: FrameNumbers,
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

    def finish(self) -> Manifest | Share:
        """Draw what has to be drawn, check everything, and write the manifest if all shards are done."""
        survey = self._work.check(retry=True)
        if survey.whole or survey.wrong:
            log.log(logging.WARNING if survey.changed else logging.INFO, "%s", survey)
        forgotten = self._work.count_forgotten()
        if forgotten:
            log.warning(
                "%d frames that an earlier run was asked for are not drawn: name them in --frames", forgotten
            )
        try:
            self._draw()
            return self._conclude()
        except BaseException:
            whole, failed = self._work.share()
            if whole:
                total = max(self._total, whole + failed)
                log.warning(
                    "%d of %d frames are whole in %s; to go on, use --resume", whole, total, self._folder.path
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
            first = self._failures[0][1]
            # what is wrong with a scene in all frames is no matter of the first one
            raise first.error if isinstance(first.error, SceneError) else _named(first)
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
            raise _named(failed)
        told = len(self._failures)
        if told < _TOLD:
            where = f" of {task.job.folder}" if task.job.folder else ""
            warnings.warn(f"frame {failed.index}{where} cannot be drawn: {error}", stacklevel=4)
        self._failures.append((task, failed))

    def _record_failure(self, task: Task, failed: Failed) -> None:
        frame = {"index": failed.index, "time": task.job.time(failed.index), "error": str(failed.error)}
        self._folder.add(self._by_folder[task.job.folder].description, frame)

    def _conclude(self) -> Manifest | Share:
        """Check all files, draw again those that are not as they were written, and write the manifest."""
        everything = self._folder.shard is not None
        if everything:
            if not self._folder.become_alone():
                log.info("other shards are being drawn: the last one writes the manifest")
                return self._work.share()
            self._folder.reread()
            if self._alike is not None:
                check_same(self._folder, self._parts, self._alike)
            take_exposures(self._folder, self._parts)
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
        self._folder.remove_strays()
        descriptions = [part.description for part in self._parts]
        write_records(self._folder.path, self._folder.records, descriptions)
        self._folder.end()
        return read_manifest(self._folder.path)


def _named(failed: Failed) -> FireflyError:
    """Return the error of a frame with its number, unless all frames of its job have it."""
    error = failed.error
    if failed.whole_job:
        return error
    named = type(error)(f"frame {failed.index}: {error}")
    named.__cause__ = error
    return named
