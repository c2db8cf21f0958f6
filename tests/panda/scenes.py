"""Small Panda3D scenes, built where they are drawn: functions that return a root and a camera."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import panda3d
from panda3d import core

ASPECT = 4.0 / 3.0

MODELS = sorted(
    str(file.relative_to(Path(panda3d.__file__).parent))
    for file in Path(panda3d.__file__).parent.glob("models/**/*.egg.pz")
)
"""All models that Panda3D's wheel brings."""


def load(name: str) -> core.NodePath:
    """A model by its path below Panda3D's package. Sequences, such as fonts, stand at their 34th frame."""
    file = core.Filename.from_os_specific(str(Path(panda3d.__file__).parent / name))
    options = core.LoaderOptions(core.LoaderOptions.LF_no_cache)
    node = core.Loader.get_global_ptr().load_sync(file, options)
    assert node is not None, name
    path = core.NodePath(node)
    for sequence in path.find_all_matches("**/+SequenceNode"):
        sequence.node().pose(min(33, sequence.node().get_num_frames() - 1))
    return path


def camera_at(root: core.NodePath, center, distance: float, near: float, far: float) -> core.NodePath:
    """A camera that looks at a point from the front, from a little to the right and above."""
    node = core.Camera("camera")
    lens = node.get_lens()
    lens.set_aspect_ratio(ASPECT)
    lens.set_fov(40)
    lens.set_near_far(near, far)
    path = root.attach_new_node(node)
    path.set_pos(core.LPoint3(*center) + core.LVector3(0.35, -1.0, 0.3) * distance)
    path.look_at(core.LPoint3(*center))
    return path


def model_scene(name: str, lit: bool = True) -> tuple[core.NodePath, core.NodePath]:
    """A model that fills the picture; lit by a sun, a lamp, a spotlight and the sky."""
    root = core.NodePath("render")
    model = load(name)
    model.reparent_to(root)
    low, high = model.get_tight_bounds()
    center, size = (low + high) / 2, max((high - low).length(), 1e-3)
    if lit:
        add_lights(root, center, size)
    return root, camera_at(root, center, 1.3 * size, 0.05 * size, 10 * size)


def add_lights(root: core.NodePath, center, size: float) -> None:
    """One light of each kind, none of which makes a surface brighter than white."""
    sky = core.AmbientLight("sky")
    sky.set_color((0.1, 0.12, 0.15, 1))
    sun = core.DirectionalLight("sun")
    sun.set_color((0.3, 0.28, 0.25, 1))
    lamp = core.PointLight("lamp")
    lamp.set_color((0.4, 0.3, 0.2, 1))
    lamp.set_attenuation((1, 0.1 / size, 0.5 / size**2))
    spot = core.Spotlight("spot")
    spot.set_color((0.3, 0.4, 0.5, 1))
    spot.get_lens().set_fov(35)
    spot.set_exponent(4)
    for light, offset in ((sky, None), (sun, (1, -2, 3)), (lamp, (-1, -1, 0.6)), (spot, (0.4, -1.2, 1))):
        path = root.attach_new_node(light)
        if offset is not None:
            path.set_pos(core.LPoint3(*center) + core.LVector3(*offset) * size)
            path.look_at(core.LPoint3(*center))
        root.set_light(path)


def card(name: str = "card", frame=(-1, 1, -1, 1)) -> core.NodePath:
    """A white square across the view, with normals towards -Y."""
    maker = core.CardMaker(name)
    maker.set_frame(*frame)
    maker.set_has_normals(True)
    return core.NodePath(maker.generate())


Build = Callable[..., tuple[core.NodePath, core.NodePath]]


def framed(name: str, frame: int | None = None) -> tuple[core.NodePath, core.NodePath]:
    """A model without lights as `firefly_sample.model_scene` frames it; an actor in a pose of panda-walk4."""
    from firefly_sample import model_scene as our_scene

    files = [name] if frame is None else [name, "models/panda-walk4.egg.pz"]
    ours = our_scene(*(Path(panda3d.__file__).parent / file for file in files))
    root = core.NodePath("render")
    model = load(name)
    model.reparent_to(root)
    if frame is not None:
        load(files[1]).reparent_to(model)
        controls = core.AnimControlCollection()
        core.auto_bind(model.node(), controls, core.PartGroup.HMF_ok_wrong_root_name)
        controls.get_anim(0).pose(frame)
        model.set_python_tag("controls", controls)  # the pose ends with them
    ours.lens.set_aspect_ratio(ASPECT)
    lens = core.MatrixLens()
    lens.set_user_mat(core.LMatrix4(*ours.lens.get_projection_mat().ravel().tolist()))
    camera = root.attach_new_node(core.Camera("camera", lens))
    camera.set_mat(core.LMatrix4(*ours.camera.get_net_mat().ravel().tolist()))
    return root, camera
