"""Captures into folders without a driver: frames that are no pictures, drawn step by step."""

from __future__ import annotations

import os

from firefly_sample.capture.closing import write_records
from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.work import Part, Work
from firefly_sample.capture.writer import FrameWriter
from tests.capture.described import DRIVER, drawn_of, job_of


def opened(path, shard=None, overwrite=False, frames=4):
    asked = {"frames": (0, frames, 1), "jobs": 1, "shard": str(shard or "")}
    return CaptureFolder(path, asked, shard, overwrite)


def parts_of(**changes):
    return [Part(job_of(**changes), DRIVER, 0)]


def draw(place, parts, frames=range(4), version=0):
    """Draw what is missing, and return the frames that were drawn."""
    tasks = list(Work(place, parts, frames).missing())
    with FrameWriter(place) as writer:
        for task in tasks:
            part = next(part for part in parts if part.job.folder == task.job.folder)
            writer.put(part, drawn_of(task.index, task.job.outputs, version))
        writer.finish()
    return [task.index for task in tasks]


def finish(place, parts):
    place.remove_strays()
    write_records(place.path, place.records, [part.description for part in parts])
    place.end()


def finished(path, **changes):
    parts = parts_of(**changes)
    with opened(path) as place:
        draw(place, parts)
        finish(place, parts)
    return parts


def names_in(path):
    return sorted(os.listdir(path))
