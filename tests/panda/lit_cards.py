"""A Panda3D scene of a card with highlights, across the view, and one light."""

from __future__ import annotations

from panda3d import core

from tests.panda.scenes import ASPECT, card

DISTANCE = 5.0
SHININESS = 20.0


def made(kind, **values):
    """A light of Panda3D after calls of its setters, its lens's for names that begin with "lens_"."""
    light = getattr(core, kind)("lamp")
    light.set_color((0.5, 0.4, 0.3, 1))
    for name, value in values.items():
        owner = light.get_lens() if name.startswith("lens_") else light
        getattr(owner, f"set_{name.removeprefix('lens_')}")(value)
    return light


def lit_card(kind, values, place):
    """A card across the view, with highlights, and a light."""
    root = core.NodePath("render")
    wall = card(frame=(-3, 3, -3, 3))
    wall.reparent_to(root)
    material = core.Material()
    material.set_ambient((1, 1, 1, 1))
    material.set_diffuse((1, 1, 1, 1))
    material.set_specular((0.5, 0.5, 0.5, 1))
    material.set_shininess(SHININESS)
    wall.set_material(material)
    path = root.attach_new_node(made(kind, **values))
    path.set_pos_hpr(*place)
    root.set_light(path)
    camera = core.Camera("camera")
    camera.get_lens().set_aspect_ratio(ASPECT)
    camera.get_lens().set_fov(40)
    eye = root.attach_new_node(camera)
    eye.set_pos(0, -DISTANCE, 0)
    return root, eye


def lamp_and_lens(kind, planes, placing):
    """The card with a lamp, through a lens of a kind, after calls that place it; its highlights are local."""
    root, eye = lit_card("PointLight", {"attenuation": (0.5, 0.1, 0.05)}, [1, -3, 0.5, 15, -10, 40])
    root.find("card").get_material().set_local(True)
    if kind == "orthographic":
        eye.node().set_lens(core.OrthographicLens())
        eye.node().get_lens().set_film_size(4, 3)
    elif kind == "matrix":
        lens = core.MatrixLens()
        lens.set_user_mat(core.LMatrix4(2, 0, 0, 0, 0.25, -0.125, 1.5, 1, 0, 8 / 3, 0, 0, 0, 0, -2.5, 0))
        eye.node().set_lens(lens)
    lens = eye.node().get_lens()
    lens.set_near_far(*planes)
    for owner, name, *arguments in placing:
        getattr({"lens": lens, "camera": eye}[owner], name)(*arguments)
    return root, eye


def shadow_of_a_card(kind, seen_by_light):
    """The shadow on a wall of a card that the camera does not see, and the light only if asked to."""
    root = core.NodePath("render")
    card("wall", frame=(-3, 3, -3, 3)).reparent_to(root)
    blocker = card("blocker", frame=(-0.4, 0.4, -0.4, 0.4))
    blocker.reparent_to(root)
    blocker.set_pos(0.5, -1.5, 0.5)
    blocker.set_two_sided(True)
    for_camera, for_light = core.BitMask32.bit(1), core.BitMask32.bit(2)
    blocker.hide(for_camera if seen_by_light else for_camera | for_light)
    root.set_material(core.Material())
    light = made(kind, shadow_caster=True, shadow_buffer_size=(1024, 1024), camera_mask=for_light)
    light.get_lens().set_near_far(0.5, 20)
    if kind == "DirectionalLight":
        light.get_lens().set_film_size(20, 20)
    elif kind == "Spotlight":
        light.get_lens().set_fov(60)
    path = root.attach_new_node(light)
    path.set_pos(1, -4, 1.5)
    path.look_at(0, 0, 0)
    root.set_light(path)
    camera = core.Camera("camera")
    camera.set_camera_mask(for_camera)
    camera.get_lens().set_aspect_ratio(ASPECT)
    camera.get_lens().set_fov(50)
    eye = root.attach_new_node(camera)
    eye.set_pos(-1, -5, 0)
    eye.look_at(0, 0, 0)
    return root, eye
