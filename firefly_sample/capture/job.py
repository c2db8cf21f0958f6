"""The description of what is captured: everything that the pixels of frames depend on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from firefly_sample.capture.names import FileNames
from firefly_sample.capture.views import Views
from firefly_sample.encoding.formats import Encoding
from firefly_sample.settings import Settings


class Driver(NamedTuple):
    """A driver: the GL renderer and version strings, and whether it is a software rasteriser."""

    name: str
    version: str
    software: bool


@dataclass(frozen=True)
class Job:
    """A scene with all its choices, of which any frame can be drawn anywhere. It can be pickled.

    Attributes
    ----------
    scene : str
        The scene's name as given: see `find_scene`.
    parameters : dict
        All parameters of the scene.
    settings : Settings
        As asked for; the exposure may be "auto".
    exposure : float or None
        The exposure of all frames; None until it is measured, if the settings say "auto".
    size : (int, int)
        Width and height in pixels.
    outputs : tuple of str
    fps, start : float
        Moment i is at the time ``start + i / fps`` in seconds.
    views : Views, optional
        The cameras that see each moment; only the scene's own when absent.
    encoding : Encoding, optional
        The formats of the files; PNG and ``.npz`` when absent.
    dataset : str, optional
        The data set that the capture is to be: a name of `firefly_sample.capture.datasets`.
    device, require_gpu
        See `firefly_sample.Renderer`; they change no pixel, because the driver is described by its name.
    sources : dict of str to str
        The SHA-256 of each file that the scene is made of, by its name as given.
    folder : str
        Where its files are, relative to the manifest: "" if the capture is no sweep.
    values : dict
        The parameters and settings that a sweep gave this job.
    """

    scene: str
    parameters: Mapping[str, Any]
    settings: Settings
    exposure: float | None
    size: tuple[int, int]
    outputs: tuple[str, ...]
    fps: float
    start: float
    views: Views | None = None
    encoding: Encoding = field(default_factory=Encoding)
    dataset: str | None = None
    device: int | None = None
    require_gpu: bool = False
    sources: Mapping[str, str] = field(default_factory=dict)
    folder: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.encoding.formats:
            object.__setattr__(self, "encoding", Encoding.of(self.outputs))

    def time(self, index: int) -> float:
        """Return the time of a frame in seconds."""
        return self.start + self.moment(index) / self.fps

    def moment(self, index: int) -> int:
        """Return the moment that a frame shows; with one view, this is the number of the frame itself."""
        return index // self.view_count

    def view(self, index: int) -> int | None:
        """Return the number of a frame's view; None if there is only the scene's own camera."""
        return None if self.views is None else index % self.view_count

    @property
    def view_count(self) -> int:
        """The number of frames of each moment."""
        return 1 if self.views is None else len(self.views)

    @property
    def names(self) -> FileNames:
        """The names of the files."""
        return FileNames(self.encoding, self.dataset, self.folder)

    @property
    def exposed(self) -> Settings:
        """The settings to draw with: the exposure is a number, unless it has yet to be measured."""
        return self.settings if self.exposure is None else self.settings.with_changes(exposure=self.exposure)

    def description(self, driver: Driver) -> dict[str, Any]:
        """Return what a manifest says of all frames, as plain JSON values."""
        from firefly_sample import __version__

        said = {
            "folder": self.folder,
            "values": dict(self.values),
            "scene": self.scene,
            "parameters": dict(self.parameters),
            "settings": self.settings.as_dict(),
            "exposure": self.exposure,
            "seed": self.parameters.get("seed"),
            "sources": dict(self.sources),
            "size": list(self.size),
            "outputs": list(self.outputs),
            "quality": None,
            "depth_scale": None,
            **self.encoding.as_json(),
            "dataset": self.dataset,
            "fps": self.fps,
            "time": self.start,
            "views": None if self.views is None else self.views.as_json(),
            "driver": driver.name,
            "driver_version": driver.version,
            "software": driver.software,
            "version": __version__,
        }
        return dict(json.loads(json.dumps(said, allow_nan=False)))


def key_of(description: Mapping[str, Any]) -> str:
    """Return a short hash of a description. Frames with the same key and index have the same pixels.

    A measured exposure is left out, because it follows from the rest, and is known only when it is measured.
    """
    counted = {name: value for name, value in description.items() if name != "exposure"}
    text = json.dumps(counted, sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True, eq=False)
class Task:
    """One frame to draw: the job, and the frame's number."""

    job: Job
    index: int


def views_text(said: Mapping[str, Any] | None) -> str:
    """Return what a description says of views, for people: "none", "orbit:24" or "100 poses"."""
    if said is None:
        return "none"
    return f"orbit:{said['orbit']}" if "orbit" in said else f"{len(said['views'])} poses"


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return how two descriptions differ, for people: for example "exposure: 1.0, now 2.0"."""
    found = []
    for name in dict.fromkeys((*before, *now)):
        old, new = before.get(name), now.get(name)
        # these three say again what parameters, settings and the driver say
        if name in ("exposure", "seed", "software") or old == new:
            continue
        if name == "formats" and old is None:  # versions that recorded no cameras had no formats
            found.append("cameras: not recorded by an earlier version, now recorded")
            continue
        changed: dict[str, tuple[Any, Any]]
        if name == "formats" and isinstance(old, Mapping) and isinstance(new, Mapping):
            both = {f"format of {key}": (old[key], new[key]) for key in old if key in new}
            changed = {key: pair for key, pair in both.items() if pair[0] != pair[1]}
        elif name == "views":
            before_text, now_text = views_text(old), views_text(new)
            changed = {name: (before_text, f"other {now_text}" if before_text == now_text else now_text)}
        elif isinstance(old, Mapping) and isinstance(new, Mapping):
            both = {key: (old.get(key), new.get(key)) for key in dict.fromkeys((*old, *new))}
            changed = {key: pair for key, pair in both.items() if pair[0] != pair[1]}
        else:
            changed = {name: (old, new)}
        if name == "sources":
            found += [f"{file} has changed" for file in changed]
        else:
            found += [f"{key}: {old}, now {new}" for key, (old, new) in changed.items()]
    return found
