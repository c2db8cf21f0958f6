"""Model files of Panda3D (.bam, .egg), read by Panda3D itself and kept alive, so that their actors move."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.graph import GraphTree
from firefly_sample.model.panda3d.package import import_panda3d
from firefly_sample.model.root import ModelRoot
from firefly_sample.scene.arrays import Float64

_MISSING_IMAGE = re.compile(r'Unable to find texture "(.+?)" on model-path')
"""Panda3D's words for an image that is not there or is none."""


class PandaClip(NamedTuple):
    """The animations of one name of a file's actors."""

    controls: tuple[Any, ...]
    """Panda3D's AnimControls."""
    duration: float


class PandaModel(ModelRoot):
    """The root of a model file of Panda3D; what is below it follows Panda3D's own graph of the file.

    Copies of it stand still.

    Parameters
    ----------
    name : str
    graph : panda3d.core.NodePath
    warnings : iterable of str
        A line for each property of the file that Panda3D could not read.
    """

    def __init__(self, name: str, graph: Any, warnings: Iterable[str] = ()) -> None:
        super().__init__(name, warnings)
        self._read = self.warnings
        self._graph = graph
        self._losses = Losses()
        self._tree = GraphTree(graph, self._losses)
        self._eye: Float64 | None = None
        self._chosen: tuple[PandaClip, ...] = ()
        self.add_child(self._tree.path.node())
        self._sequences = [path.node() for path in graph.find_all_matches("**/+SequenceNode")]
        self._find_animations()

    def light(self, lit: bool | None) -> None:
        """Choose whether surfaces are lit; None: if the file has a light, as in Panda3D."""
        if lit != self._tree.lit:
            self._tree.lit = lit
            self._follow()

    def look_from(self, eye: Float64) -> None:
        """Show levels of detail and billboards as a camera of ours sees them; see `ModelRoot.look_from`."""
        if self._eye is None or not np.array_equal(eye, self._eye):
            self._eye = eye
            self._follow()

    def borrow(self, other: ModelRoot) -> bool:
        """Take over the animations of a file that has nothing else; return whether it had any that fit."""
        if not isinstance(other, PandaModel) or other is self or not other.has_only_animations:
            return False
        before = len(self._clips)
        other._graph.reparent_to(self._graph)
        self._find_animations()
        return len(self._clips) > before

    @property
    def has_only_animations(self) -> bool:
        """True if the file has animations and no geometry."""
        has_animations = not self._graph.find("**/+AnimBundleNode").is_empty()
        return has_animations and self._graph.find("**/+GeomNode").is_empty()

    def choose(self, clips: Sequence[PandaClip]) -> None:
        """Make `update` show these of the animations; of two for one actor, the last one counts."""
        for clip in self._clips.values():
            for control in clip.controls:
                control.get_part().clear_control_effects()
        self._chosen = tuple(clips)

    def update(self, time: float) -> None:
        """Pose the actors and sequences as Panda3D shows them at `time` (seconds), played from 0 in a loop.

        Like Panda3D, it shows whole frames.
        """
        for clip in self._chosen:
            for control in clip.controls:
                control.pose(_frame(time, control.get_frame_rate(), control.get_num_frames()))
        for sequence in self._sequences:
            sequence.pose(_frame(time, sequence.get_frame_rate(), sequence.get_num_frames()))
        self._follow()

    def make_copy(self) -> ModelRoot:  # type: ignore[override]
        """Return a ModelRoot with the same attributes, without children."""
        made = ModelRoot(self.name, self.warnings)
        made.tags = dict(self.tags)
        made.set_transform(self.transform)
        return made

    def _find_animations(self) -> None:
        """Tie the animations in Panda3D's graph to the actors in it, and play the first one."""
        core = import_panda3d()
        group = core.PartGroup
        found = core.AnimControlCollection()
        flags = group.HMF_ok_part_extra | group.HMF_ok_anim_extra | group.HMF_ok_wrong_root_name
        core.auto_bind(self._graph.node(), found, flags)
        controls: dict[str, list[Any]] = {}
        for index in range(found.get_num_anims()):
            control = found.get_anim(index)
            controls.setdefault(control.get_anim().get_name(), []).append(control)
        self._clips = {
            name: PandaClip(tuple(same), max(each.get_num_frames() / each.get_frame_rate() for each in same))
            for name, same in controls.items()
        }
        self.play(next(iter(self._clips), None))
        self.update(0.0)

    def _follow(self) -> None:
        """Bring our nodes to the state of Panda3D's."""
        for camera in self._tree.update(self._eye):
            camera.note_fault(self._losses)
        self.warnings = (*self._read, *self._losses.lines())


def _frame(time: float, rate: float, count: int) -> int:
    if count <= 0:
        return 0
    return math.floor(round(math.fmod(time * rate, count), 6)) % count  # 17 / 24 seconds are frame 17


def read_panda3d(path: Path, max_texture_megapixels: float) -> PandaModel:
    """Return the root of a model file that Panda3D can read.

    Images that are missing, and all that is not drawn, are named by the root's `warnings`.

    Raises
    ------
    ModelError
        If the file is damaged, or an image is too large.
    MissingPackageError
        If Panda3D is not installed.
    """
    core = import_panda3d()
    options = core.LoaderOptions(core.LoaderOptions.LF_no_cache | core.LoaderOptions.LF_report_errors)
    file = core.Filename.from_os_specific(str(path.absolute()))
    with _quiet(core) as heard:
        node = core.Loader.get_global_ptr().load_sync(file, options)
    if node is None:
        raise ModelError(f"model {path}: Panda3D cannot read it: {_reason(heard, path)}")
    graph = core.NodePath(node)
    for texture in graph.find_all_textures():
        megapixels = texture.get_x_size() * texture.get_y_size() * texture.get_z_size() / 1e6
        if megapixels > max_texture_megapixels:
            raise ModelError(
                f"model {path}: image {texture.get_name()!r} has {megapixels:.3g} megapixels, more than "
                f"max_texture_megapixels, {max_texture_megapixels:g}"
            )
    losses = Losses()
    for name in _MISSING_IMAGE.findall(heard[0]):
        losses.add("images that are missing or damaged", name)
    return PandaModel(path.name.split(".")[0], graph, losses.lines())


@contextmanager
def _quiet(core: Any) -> Iterator[list[str]]:
    """Let Panda3D load without decoding images; what it says meanwhile is in the list afterwards."""
    preload = core.ConfigVariableBool("preload-textures")
    before = preload.get_value()
    stream, heard = core.StringStream(), [""]
    core.Notify.ptr().set_ostream_ptr(stream, False)
    preload.set_value(False)
    try:
        yield heard
    finally:
        preload.set_value(before)
        core.Notify.ptr().set_ostream_ptr(None, False)  # back to stderr
        heard[0] = stream.data.decode(errors="replace")


def _reason(heard: Sequence[str], path: Path) -> str:
    """Return Panda3D's reason why it cannot read a file, in one line, without what it says of every file."""
    lines = [line.strip() for line in "".join(heard).splitlines()]
    found = [
        re.sub(r"^:\S+\(\w+\): ", "", line).replace(str(path.absolute()), path.name)
        for line in lines
        if line.strip(" ^") and "Couldn't load file" not in line and "Error reading" not in line
    ]
    return "; ".join(found).replace(":; ", ": ") or "it gives no reason"
