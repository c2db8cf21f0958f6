"""A Panda3D graph that is lit by shaders of its own, as that of Panda3D's sample "fireflies", as a Scene.

Such a graph has no lights that Panda3D knows: a camera with a shader draws a ball for each light, and adds up
what it draws. The ball's shader input "lightcolor" is the light's colour, and its scale is the light's reach.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from firefly_sample.errors import SceneError
from firefly_sample.interop.panda3d.mirror import GraphMirror
from firefly_sample.losses import Losses
from firefly_sample.scene.lights import PointLight
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene

LIGHT_INPUT = "lightcolor"
_WORD = re.compile(r"[A-Za-z_]\w*")
_COUNT = re.compile(r"(\d+) inputs")
_CG_PREFIX = "k_"
"""Of shader inputs, in the text of shaders in Cg."""


class DeferredScene(NamedTuple):
    """A converted graph.

    Attributes
    ----------
    scene : Scene
    models, lights, dots : int
        How many GeomNodes of models, lights and dots there are.
    lines : list of str
        A line for each kind of thing that is not drawn, or is drawn differently, with names.
    """

    scene: Scene
    models: int
    lights: int
    dots: int
    lines: list[str]


class Cameras(NamedTuple):
    """Paths to the cameras of a graph, by what they draw."""

    models: Any
    lights: Any
    plain: Any  # None if there is none


def from_deferred(root: Any) -> DeferredScene:
    """Return a graph that is lit by shaders of its own as a new Scene, for the look "classic".

    `find_cameras` tells its cameras apart.

    - What the models' camera sees becomes models, as `GraphMirror` reads it.
    - A node with geometry that the lights' camera sees, at or below a node with the shader input
      "lightcolor", becomes a `PointLight` at its origin. The light has that colour, the name of the node with
      the input, and a radius that is the scale of the node with geometry, along x.
    - Geometry there that the plain camera sees, and that is added to the picture, becomes `Sprites`. They are
      as wide as it is, and have its colour. Its texture is not used.

    The graph is the same afterwards.

    Parameters
    ----------
    root : panda3d.core.NodePath
        The top of the graph.

    Raises
    ------
    SceneError
        If the lights' camera, the models' camera or all lights are missing.
    """
    cameras, losses = find_cameras(root), Losses()
    owners = [path for path in root.find_all_matches("**") if _light_color(path) is not None]
    _name_shaders(cameras, owners, losses)
    found = _sort(root, cameras, losses)
    for owner in owners:
        if not any(owner == each for each, _ in found.lights):
            losses.add("nodes without a ball that the lights' camera sees give no light", owner.get_name())
    if not found.lights:
        raise SceneError(
            "the graph has no lights: no geometry that the lights' camera sees has a shader input "
            f"{LIGHT_INPUT!r}"
        )
    unseen = [owner for owner in owners if not any(map(owner.is_ancestor_of, found.models))]
    mirror = GraphMirror(root, cameras.models, lit=True)
    with _stashed(unseen), _without_shader(cameras.models.node()):
        scene = mirror.update()
    _add_lights(scene, root, found.lights)
    if found.dots:
        _add_dots(scene, root, found.dots, losses)
    lines = [*losses.lines(), *mirror.losses.lines()]
    return DeferredScene(scene, len(found.models), len(found.lights), len(found.dots), lines)


class _Found(NamedTuple):
    """Paths to GeomNodes by what they become; lights with the node that has their colour."""

    models: list[Any]
    lights: list[tuple[Any, Any]]
    dots: list[Any]


def _sort(root: Any, cameras: Cameras, losses: Losses) -> _Found:
    """Return the geometry of a graph by what sees it, and name what is not drawn."""
    found = _Found([], [], [])
    for path in root.find_all_matches("**/+GeomNode"):
        owner = next((above for above in path.get_ancestors() if _light_color(above) is not None), None)
        if _is_seen(path, cameras.models):
            found.models.append(path)
        elif owner is not None and _is_seen(path, cameras.lights):
            found.lights.append((owner, path))
        elif cameras.plain is not None and _is_seen(path, cameras.plain):
            if owner is not None and _adds(path):
                found.dots.append(path)
            else:
                losses.add("geometry that the models' camera does not see is not drawn", path.get_name())
    return found


def find_cameras(root: Any) -> Cameras:
    """Return the models', the lights' and the plain camera of a graph.

    A camera's initial state decides which one it is.

    The lights' camera has a shader and blends colours. The models' camera has a shader and does not. The
    plain camera has no shader. Cameras that are not active do not count. Of several of a kind, the first one
    counts.

    Raises
    ------
    SceneError
        If the models' camera or the lights' camera is missing.
    """
    from panda3d import core

    found: dict[str, Any] = {}
    for path in root.find_all_matches("**/+Camera"):
        node = path.node()
        if node.as_light() is not None or not node.is_active():
            continue
        state = node.get_initial_state()
        blend = state.get_attrib(core.ColorBlendAttrib.get_class_type())
        kind = "plain"
        if _shader(state) is not None:
            kind = "models" if blend is None or blend.get_mode() == blend.M_none else "lights"
        found.setdefault(kind, path)
    for kind, what in (("models", "draws models"), ("lights", "adds up lights")):
        if kind not in found:
            raise SceneError(f"the graph is not lit by shaders of its own: no camera with a shader {what}")
    return Cameras(found["models"], found["lights"], found.get("plain"))


def shaders_of(cameras: Cameras) -> list[Any]:
    """Return the shaders of cameras."""
    shaders = [_shader(camera.node().get_initial_state()) for camera in cameras if camera is not None]
    return [shader for shader in shaders if shader is not None]


def shader_name(shader: Any) -> str:
    """Return the name of a shader's file."""
    return str(shader.get_filename(shader.ST_fragment).get_basename())


def _shader(state: Any) -> Any:
    attrib = _shader_attrib(state)
    return None if attrib is None else attrib.get_shader()


def _shader_attrib(state: Any) -> Any:
    from panda3d import core

    return state.get_attrib(core.ShaderAttrib.get_class_type())


def _light_color(path: Any) -> tuple[float, float, float] | None:
    """Return the colour of the lights of a node, if it has the input for it."""
    attrib = _shader_attrib(path.node().get_state())
    if attrib is None or not attrib.has_shader_input(LIGHT_INPUT):
        return None
    red, green, blue, _ = attrib.get_shader_input_vector(LIGHT_INPUT)
    return red, green, blue


def _name_shaders(cameras: Cameras, owners: Iterable[Any], losses: Losses) -> None:
    """Name the shaders of cameras, and all shader inputs but the colours of lights."""
    words: set[str] = set()
    for shader in shaders_of(cameras):
        losses.add("shaders of cameras are not run: the look takes their place", shader_name(shader))
        for stage in (shader.ST_vertex, shader.ST_geometry, shader.ST_fragment):  # one text, in Cg
            words.update(word.removeprefix(_CG_PREFIX) for word in _WORD.findall(shader.get_text(stage)))
    states = [camera.node().get_initial_state() for camera in cameras if camera is not None]
    for state in (*states, *(owner.node().get_state() for owner in owners)):
        attrib = _shader_attrib(state)
        if attrib is None:
            continue
        known = [word for word in sorted(words) if attrib.has_shader_input(word)]
        for word in known:
            if word != LIGHT_INPUT:
                losses.add("shader inputs are not used", word)
        count = _COUNT.search(str(attrib))
        if count is not None and int(count[1]) > len(known):
            losses.add("shader inputs are not used", "one that no shader reads")


def _is_seen(path: Any, camera: Any) -> bool:
    """Return whether a camera's mask lets it see a node."""
    from panda3d import core

    everything = core.PandaNode.get_overall_bit() | core.PandaNode.get_all_camera_mask()
    mask = everything
    for node in reversed(list(path.get_nodes())):
        control, show = node.get_draw_control_mask(), node.get_draw_show_mask()
        mask = (mask & ~control) | (show & control)
    overall = core.PandaNode.get_overall_bit()
    return bool((mask & overall).get_word() and (mask & camera.node().get_camera_mask()).get_word())


def _adds(path: Any) -> bool:
    """Return whether what a node draws is added to what is behind it."""
    from panda3d import core

    blend = path.get_net_state().get_attrib(core.ColorBlendAttrib.get_class_type())
    return blend is not None and blend.get_mode() == blend.M_add


@contextmanager
def _stashed(paths: Iterable[Any]) -> Iterator[None]:
    """Take nodes out of the graph meanwhile."""
    stashed = [path for path in paths if path.has_parent() and not path.is_stashed()]
    for path in stashed:
        path.stash()
    try:
        yield
    finally:
        for path in stashed:
            path.unstash()


@contextmanager
def _without_shader(camera: Any) -> Iterator[None]:
    """Leave the shader out of a camera's initial state meanwhile."""
    from panda3d import core

    state = camera.get_initial_state()
    camera.set_initial_state(state.remove_attrib(core.ShaderAttrib.get_class_type()))
    try:
        yield
    finally:
        camera.set_initial_state(state)


def _add_lights(scene: Scene, root: Any, lights: Sequence[tuple[Any, Any]]) -> None:
    for owner, path in lights:
        light = PointLight(owner.get_name(), _light_color(owner) or (0.0,) * 3, abs(path.get_sx(root)))
        scene.root.attach_new_node(light).set_pos(*path.get_pos(root))


def _add_dots(scene: Scene, root: Any, dots: Sequence[Any], losses: Losses) -> None:
    """Add one node with all dots, each a ball as wide as its geometry."""
    from panda3d import core

    places, colors, radii = [], [], []
    for path in dots:
        low, high = path.get_tight_bounds(root)
        places.append(tuple((low + high) / 2.0))
        radii.append(max(high - low) / 2.0)
        state = path.get_net_state()
        attrib = state.get_attrib(core.ColorAttrib.get_class_type())
        flat = attrib is not None and attrib.get_color_type() == core.ColorAttrib.T_flat
        red, green, blue, alpha = attrib.get_color() if flat else (1.0,) * 4
        blend = state.get_attrib(core.ColorBlendAttrib.get_class_type())
        share = alpha if blend.get_operand_a() == blend.O_incoming_alpha else 1.0
        colors.append((red * share, green * share, blue * share))
        losses.add(
            "dots are round and soft without their textures, and hidden by what is before them",
            path.get_name(),
        )
    scene.root.attach_new_node(Sprites("dots", places, colors, radii))
