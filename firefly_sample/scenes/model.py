"""Model files as a scene: the scene plugin "model", and what `find_scene` returns for the name of a file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from firefly_sample.errors import ModelError, SceneError, did_you_mean
from firefly_sample.model.conventions import turn
from firefly_sample.model.formats import is_panda3d
from firefly_sample.model.framing import frame_camera, visible_bounds
from firefly_sample.model.load import GLTF_SUFFIXES, load_model
from firefly_sample.model.root import ModelRoot
from firefly_sample.model.studio import add_default_lights, add_ground
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.parameter import KeyStep, Parameter, resolve_parameters
from firefly_sample.scene.scene import Camera
from firefly_sample.scene.traversal import iter_visible
from firefly_sample.scenes.files import check_file, files_stem, split_files
from firefly_sample.scenes.plugin import LiveScene, Plugin, set_visible, switch, with_keys

if TYPE_CHECKING:
    from firefly_sample.model.formats import Up

NAME = "model"
PANDA3D_GREY = (0.41, 0.41, 0.41)
"""The background of Panda3D's windows by default, as codes."""
CODES = 0.67
"""A factor of the default lights for models that are lit in codes: with it, they nearly fill the range."""
POSES = 16
"""Moments of an animation at which the model is framed."""

_PARAMETERS = (
    Parameter("file", str, "", "The model's file; commas separate several.", live=False),
    Parameter(
        "file_scene",
        str,
        "",
        "A scene of a glTF file by its name or number, from 0; by default the file's own choice.",
        live=False,
    ),
    Parameter(
        "up",
        str,
        "auto",
        "The axis of the file that points up: by default the format's own.",
        live=False,
        choices=("auto", "x", "y", "z"),
    ),
    Parameter(
        "camera",
        str,
        "auto",
        "A camera of the file by its name; auto: the first one or, if there is none, one that frames the "
        "model; frame: always that one.",
        live=False,
    ),
    Parameter(
        "animation",
        str,
        "first",
        "The animation that plays, by its name; first: the file's first one; all; none.",
        live=False,
    ),
    Parameter(
        "max_texture_megapixels",
        float,
        100.0,
        "Refuse textures with more pixels than this before they are decoded.",
        1e-6,
        1e6,
        "megapixels",
        live=False,
    ),
    with_keys(
        Parameter(
            "turntable",
            float,
            0.0,
            "Time in which the model turns once; 0: it stands still.",
            0.0,
            1e6,
            "seconds",
        ),
        KeyStep("n", add=4.0, help="turn, or turn more slowly"),
        KeyStep("m", add=-4.0, help="turn faster, or stand still"),
    ),
    Parameter(
        "lights",
        str,
        "auto",
        "The lights of the file, default ones, or both; auto: the file's if it has any. Files of Panda3D "
        "without any show their colours unlit, as in Panda3D.",
        choices=("auto", "file", "default", "both"),
        keys=(KeyStep("l", help="next choice of lights"),),
    ),
    switch(
        "ground", True, "A ground that shows the model's shadow in the default lights.", "g", "ground on, off"
    ),
)


class ModelScene(LiveScene):
    """Models from files, with a camera and lights of the files or default ones.

    `turntable`, `lights` and `ground` are live.

    Parameters
    ----------
    name : str
        The scene's name in errors.
    parameters
        Those of the plugin.

    Raises
    ------
    ModelError
        If a file is missing or damaged.
    SceneError
        If a file has nothing to draw, or no camera or animation of a given name.
    """

    def __init__(self, name: str, /, **parameters: Any) -> None:
        super().__init__(NAME, _PARAMETERS, parameters, PerspectiveLens())
        self.name = name
        files = split_files(self.values["file"])
        if not files:
            raise SceneError(f"scene {name!r}: no file is given: name one, as in firefly capture model.glb")
        self._turning = self.root.attach_new_node("turntable")
        for file in files:
            check_file(file)
            self._load(file).reparent_to(self._turning)
        self._lend_animations()
        self._is_panda3d = all(is_panda3d(Path(file)) for file in files)
        self._play(self.values["animation"])
        self._check_visible()
        self._file_camera = self._find_camera(self.values["camera"])
        self._axis = (0.0, 0.0, 0.0)  # where it is does not matter while nothing turns
        try:
            self._place()
        except SceneError as error:  # of models that are too large, and of animations
            raise ModelError(f"model {self.values['file']}: {error}") from error
        self.apply("lights")

    def _place(self) -> None:
        """Place camera, default lights and ground."""
        self._place_camera()
        self._file_lights = self._turning.find_all_matches("**/+ShadowCaster")
        for light in self._file_lights:
            for child in light.get_children():
                child.show_through()  # a light may be hidden, but not what the file has below it
        self._default_lights = add_default_lights(self, CODES if self._is_panda3d else 1.0)
        self._backdrop = self.background
        self._ground = add_ground(self, self._turning, turns=True, times=self._poses())
        self.update(0.0)

    def apply(self, name: str) -> None:
        """Put the new value of a live parameter into effect."""
        if name == "turntable":
            return  # `update` reads it
        lights, own = self.values["lights"], bool(self._file_lights)
        by_default = lights in ("default", "both") or (lights == "auto" and not own and not self._is_panda3d)
        for path in self._file_lights:
            set_visible(path, lights != "default")
        night = PANDA3D_GREY if self._is_panda3d else (0.0, 0.0, 0.0)
        self.background = self._backdrop if by_default else night
        for model in self._models():
            model.light(True if by_default else None)
        set_visible(self._default_lights, by_default)
        set_visible(self._ground, by_default and self.values["ground"])

    def update(self, time: float) -> None:
        """Set animations, turntable and camera to their state at `time`."""
        super().update(time)
        seconds = self.values["turntable"]
        angle = 360.0 * math.fmod(time, seconds) / seconds if seconds > 0.0 else 0.0
        self._turn(angle)
        if self._file_camera is not None:
            # where it is in the file, without scale: the camera stays while the model turns
            place = self._file_camera.get_transform(self._turning)
            self.camera.set_transform(place.set_scale((1.0, 1.0, 1.0)).set_shear((0.0, 0.0, 0.0)))
        for path in self._turning.get_children():
            model = path.node()
            if isinstance(model, ModelRoot):
                model.look_from(self.camera.get_mat(path))

    def _turn(self, degrees: float) -> None:
        """Turn the models about the vertical axis through the focus."""
        x, y, _ = self._axis
        cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        self._turning.set_pos_hpr(x - (x * cos - y * sin), y - (x * sin + y * cos), 0.0, degrees, 0.0, 0.0)

    def _load(self, file: str) -> NodePath:
        """Return a model in which an axis of the file is up; "auto" is the format's own."""
        scene, limit, up = (self.values[name] for name in ("file_scene", "max_texture_megapixels", "up"))
        path = load_model(
            file, scene=scene or None, max_texture_megapixels=limit, up=None if up == "auto" else up
        )
        if Path(file).suffix.lower() in GLTF_SUFFIXES and up not in ("auto", "y"):
            matrix = np.eye(4)
            matrix[:3, :3] = turn("y").T @ turn(cast("Up", up))  # back to the file's axes, and on
            path.set_mat(matrix)
        return path

    def _models(self) -> list[ModelRoot]:
        """Return the roots of the files' models."""
        nodes = [path.node() for path in self._turning.get_children()]
        return [node for node in nodes if isinstance(node, ModelRoot)]

    def _lend_animations(self) -> None:
        """Give the animations of files that have nothing else to the models that can play them."""
        for path in self._turning.get_children():
            lender = path.node()
            if isinstance(lender, ModelRoot) and sum(model.borrow(lender) for model in self._models()):
                path.remove_node()

    def _play(self, animation: str) -> None:
        """Let every model play the animation, if it has it; those that lack it rest."""
        models = self._models()
        if animation in ("first", "all"):
            for model in models:
                model.play("all" if animation == "all" else next(iter(model.animations), None))
            return
        names = dict.fromkeys(name for model in models for name in model.animations)
        if animation != "none" and animation not in names:
            raise SceneError(_no_such(self.name, "animation", animation, [*names, "first", "all", "none"]))
        for model in models:
            model.play(animation if animation in model.animations else None)

    def _poses(self) -> tuple[float, ...]:
        """Return the times at which the models are framed: those of the longest animation that plays."""
        longest = 0.0
        for model in self._models():
            if model.playing is not None:
                clips = model.animations
                playing = clips.values() if model.playing not in clips else [clips[model.playing]]
                longest = max([longest, *(clip.duration for clip in playing)])
        return tuple(longest * part / POSES for part in range(POSES)) if longest > 0.0 else (0.0,)

    def _check_visible(self) -> None:
        """Raise a ModelError if there is nothing to draw; it says what the files have instead."""
        seen = (visit.node for visit in iter_visible(self._turning))
        if any(isinstance(node, GeomNode) and node.geoms for node in seen):
            return
        losses = [line for model in self._models() for line in model.warnings]
        because = f": {'; '.join(losses)}" if losses else ""
        raise ModelError(f"model {self.values['file']}: no visible triangles, so nothing to draw{because}")

    def _find_camera(self, name: str) -> NodePath | None:
        """Return the camera of the files that is used; None if one is placed that frames the models."""
        cameras = self._turning.find_all_matches("**/+Camera")
        named = [path for path in cameras if path.get_name() == name]
        if name not in ("auto", "frame") and not named:
            names = dict.fromkeys(path.get_name() for path in cameras)
            raise SceneError(_no_such(self.name, "camera", name, [*names, "auto", "frame"]))
        return next(iter(named or cameras), None) if name != "frame" else None

    def _place_camera(self) -> None:
        """Use a camera of the files, or place one that frames the models."""
        if self._file_camera is None:
            turns = self.values["turntable"] > 0.0
            frame_camera(self, self._turning, turns=turns, times=self._poses())
            assert self.focus is not None
            self._axis = self.focus
            self.update(0.0)
            return
        node = self._file_camera.node()
        assert isinstance(node, Camera)
        self.camera_node.lens = node.lens.make_copy()
        self.focus = self._axis = tuple(visible_bounds(self, self._turning).center.tolist())
        self.update(0.0)


def _no_such(scene: str, what: str, name: str, known: Sequence[str]) -> str:
    return f"scene {scene!r}: there is no {what} {name!r}{did_you_mean(name, known)}: give {', '.join(known)}"


scene = Plugin(
    NAME,
    "Models from files, with their own cameras and lights or default ones.",
    _PARAMETERS,
    partial(ModelScene, NAME),
    start_time=0.0,
    # files have lights in candela and lux, whose ranges end as glTF says; a studio's shadow has a soft edge
    settings={"exposure": "auto", "range_falloff": "gltf", "shadow_taps": 16},
)


def file_plugin(files: str) -> Plugin:
    """Return the plugin for files, see `split_files`; raise a ModelError if one is missing."""
    names = split_files(files)
    for file in names:
        check_file(file)
    first, *others = _PARAMETERS
    by_panda3d = bool(names) and all(is_panda3d(Path(file)) for file in names)
    return replace(
        scene,
        name=files,
        parameters=(replace(first, default=files), *others),
        build=partial(_build_file, files),
        folder=files_stem(files),
        settings={"look": "panda3d"} if by_panda3d else scene.settings,
    )


def _build_file(files: str, /, **parameters: Any) -> ModelScene:
    return ModelScene(files, **({"file": files} | parameters))


def model_scene(*files: str | Path, **parameters: Any) -> ModelScene:
    """Return a scene with models from files, ready to be drawn.

    Parameters
    ----------
    files : str or path
        One file or more; their models share one space.
    parameters
        Those of the scene "model", as ``firefly capture model --help`` lists them: up, camera, animation,
        turntable, lights, ground.

    Raises
    ------
    ModelError
        If a file is missing or damaged.
    SceneError
        If a parameter is wrong, or there is nothing to draw.
    """
    name = ",".join(map(str, files))
    resolve_parameters(name or NAME, _PARAMETERS, parameters)
    return ModelScene(name or NAME, **({"file": name} | parameters))
