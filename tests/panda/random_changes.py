"""Random changes of a Panda3D graph between two updates."""

from __future__ import annotations

import numpy as np
from panda3d import core

from tests.panda.random_scenes import Choices, add_piece, material, small, texture


def change(choices: Choices, root: core.NodePath, camera: core.NodePath) -> str:
    """Change something; return what it was."""
    numbers = choices.numbers("change")
    names = list(CHANGES)
    name = names[numbers.integers(len(names))]
    CHANGES[name](choices, numbers, root, camera)
    return name


def _any(numbers, root, pattern="**", also=lambda path: True):
    """Some path below the root, or None."""
    found = [path for path in root.find_all_matches(f"{pattern};+s") if also(path)]
    return found[numbers.integers(len(found))] if found else None


def _piece(numbers, root):
    return _any(numbers, root, "**/+GeomNode")


def _move(choices, numbers, root, camera):
    path = _any(numbers, root)
    path.set_pos(path.get_pos() + core.LVector3(*numbers.uniform(-1, 1, 3)))
    path.set_hpr(path.get_hpr() + core.LVecBase3(*numbers.uniform(-20, 20, 3)))


def _scale(choices, numbers, root, camera):
    _piece(numbers, root).set_scale(*numbers.choice([-1, 1]) * numbers.uniform(0.5, 1.5, 3))


def _reparent(choices, numbers, root, camera):
    path = _any(numbers, root)
    other = _any(numbers, root)
    if not any(step.node() == path.node() for step in other.get_ancestors()):
        (path.wrt_reparent_to if numbers.integers(2) else path.reparent_to)(other)


def _instance(choices, numbers, root, camera):
    path, other = _piece(numbers, root), _any(numbers, root)
    if not path.node().is_of_type(core.LightLensNode) and not any(
        step.node() == path.node() for step in other.get_ancestors()
    ):
        path.instance_to(other.attach_new_node("by instance"))


def _stash(choices, numbers, root, camera):
    path = _any(numbers, root, also=lambda path: path.find("**/+Camera").is_empty())
    path.unstash() if path.is_stashed() else path.stash()


def _hide(choices, numbers, root, camera):
    path = _any(numbers, root)
    path.show() if path.is_hidden() else path.hide()


def _mask(choices, numbers, root, camera):
    _any(numbers, root).hide(core.BitMask32(int(numbers.integers(1, 8))))


def _camera_mask(choices, numbers, root, camera):
    camera.node().set_camera_mask(core.BitMask32(int(numbers.integers(1, 8))))


def _color(choices, numbers, root, camera):
    path = _any(numbers, root)
    if numbers.integers(2):
        path.set_color(*numbers.uniform(0, 1, 3), 1, int(numbers.integers(3)))
    else:
        path.clear_color()


def _color_scale(choices, numbers, root, camera):
    _any(numbers, root).set_color_scale(*numbers.uniform(0.3, 1, 3), 1)


def _new_material(choices, numbers, root, camera):
    _piece(numbers, root).set_material(material(choices, False), 1)


def _material_in_place(choices, numbers, root, camera):
    path = _any(numbers, root, also=lambda path: path.has_material())
    if path is not None:
        made = path.get_material()
        made.set_diffuse((*numbers.uniform(0, 1, 3), 1))
        made.set_specular((*numbers.uniform(0, 1, 3), 1))
        made.set_shininess(numbers.choice([0, 3, 30]))


def _new_texture(choices, numbers, root, camera):
    _piece(numbers, root).set_texture(texture(choices), 1)


def _texture_in_place(choices, numbers, root, camera):
    found = root.find_all_textures()
    if len(found):
        image = found[int(numbers.integers(len(found)))]
        if numbers.integers(2):
            image.set_wrap_u(core.SamplerState.WM_clamp)
            image.set_minfilter(core.SamplerState.FT_nearest)
            image.set_magfilter(core.SamplerState.FT_nearest)
        elif image.has_ram_image():
            size = len(image.modify_ram_image())
            image.set_ram_image(numbers.integers(0, 256, size, dtype=np.uint8).tobytes())


def _texture_off(choices, numbers, root, camera):
    path = _piece(numbers, root)
    path.clear_texture() if numbers.integers(2) else path.set_texture_off(2)


def _texture_matrix(choices, numbers, root, camera):
    _piece(numbers, root).set_tex_offset(core.TextureStage.get_default(), *numbers.uniform(-1, 1, 2))


def _vertices(choices, numbers, root, camera):
    node = _piece(numbers, root).node()
    if node.get_num_geoms():
        data = node.modify_geom(0).modify_vertex_data()
        column = ("vertex", "normal", "texcoord", "color")[numbers.integers(4)]
        if data.has_column(column):
            writer = core.GeomVertexRewriter(data, column)
            while not writer.is_at_end():
                writer.set_data4(writer.get_data4() * 0.9)


def _geoms(choices, numbers, root, camera):
    node = _piece(numbers, root).node()
    if node.get_num_geoms() and numbers.integers(2):
        node.remove_geom(0)
    else:
        node.add_geoms_from(small(choices).node())


def _geom_state(choices, numbers, root, camera):
    node = _piece(numbers, root).node()
    if node.get_num_geoms():
        attrib = core.ColorAttrib.make_flat((*numbers.uniform(0, 1, 3), 1))
        node.set_geom_state(0, node.get_geom_state(0).set_attrib(attrib, 2))


def _light(choices, numbers, root, camera):
    path = _any(numbers, root, also=lambda path: path.node().as_light() is not None)
    if path is not None:
        node = path.node()
        node.set_color((*numbers.uniform(0, 1, 3), 1))
        if isinstance(node, (core.PointLight, core.Spotlight)):
            node.set_attenuation(core.LVecBase3(1, *numbers.uniform(0, 0.2, 2)))
        if isinstance(node, core.Spotlight):
            node.get_lens().set_fov(numbers.uniform(20, 100))
            node.set_exponent(numbers.choice([0, 4]))
        if isinstance(node, core.DirectionalLight):
            node.set_direction(core.LVector3(*numbers.uniform(-1, 1, 3)))


def _remove_light(choices, numbers, root, camera):
    path = _any(numbers, root, also=lambda path: path.node().as_light() is not None)
    if path is not None:
        if numbers.integers(2):
            root.clear_light(path)
        path.remove_node()


def _add_light(choices, numbers, root, camera):
    lamp = core.PointLight("new lamp")
    lamp.set_color((*numbers.uniform(0, 1, 3), 1))
    path = _any(numbers, root).attach_new_node(lamp)
    path.set_pos(root, *numbers.uniform(-4, 4, 3))
    if numbers.integers(2):
        root.set_light(path)


def _far_light(choices, numbers, root, camera):
    sun = core.NodePath("far").attach_new_node(core.DirectionalLight("far sun"))
    sun.set_hpr(*numbers.uniform(-90, 90, 3))
    if numbers.integers(3):
        root.set_light(sun)
        return
    # only those: lights of the graph that were set once count as set, which a new conversion cannot know
    attrib = root.get_attrib(core.LightAttrib)
    for path in () if attrib is None else attrib.get_on_lights():
        if path.get_name() == "far sun":
            root.clear_light(path)


def _light_off(choices, numbers, root, camera):
    path = _any(numbers, root)
    path.set_light_off() if numbers.integers(2) else path.clear_light()


def _add(choices, numbers, root, camera):
    path = add_piece(choices, 0, False)
    path.reparent_to(_any(numbers, root))
    path.set_pos(root, numbers.uniform(-3, 3), 0, numbers.uniform(-2, 2))


def _remove(choices, numbers, root, camera):
    path = _any(numbers, root, also=lambda path: path.find("**/+Camera").is_empty())
    if path.node() != camera.node():
        path.remove_node()


def _state(choices, numbers, root, camera):
    path = _any(numbers, root)
    (
        lambda: path.set_two_sided(True),
        lambda: path.set_attrib(core.CullFaceAttrib.make_reverse()),
        path.set_render_mode_wireframe,
        lambda: path.set_depth_offset(1),
        lambda: path.set_transparency(core.TransparencyAttrib.M_binary),
        lambda: path.set_transparency(core.TransparencyAttrib.M_alpha),
        lambda: path.node().set_state(core.RenderState.make_empty()),
    )[numbers.integers(7)]()


def _switch(choices, numbers, root, camera):
    path = _any(numbers, root, "**/+SwitchNode")
    if path is not None:
        path.node().set_visible_child(int(numbers.integers(2)))


def _level(choices, numbers, root, camera):
    path = _any(numbers, root, "**/+LODNode")
    if path is not None:
        path.node().set_switch(0, numbers.uniform(5, 30), 0)


def _lens(choices, numbers, root, camera):
    node = camera.node()
    if numbers.integers(2):
        node.get_lens().set_film_offset(numbers.uniform(-0.05, 0.05) * node.get_lens().get_film_size()[0], 0)
    else:
        lens = core.PerspectiveLens()
        lens.set_fov(numbers.uniform(30, 60))
        lens.set_aspect_ratio(4 / 3)
        node.set_lens(lens)


def _text(choices, numbers, root, camera):
    path = _any(numbers, root, "**/+TextNode")
    if path is not None:
        path.node().set_text("spark")
        path.node().set_text_color(*numbers.uniform(0, 1, 3), 1)


def _billboard(choices, numbers, root, camera):
    path = _piece(numbers, root)
    path.clear_billboard() if path.has_billboard() else path.set_billboard_point_eye()


def _camera(choices, numbers, root, camera):
    camera.set_pos(camera, *numbers.uniform(-1, 1, 3))


def _sort(choices, numbers, root, camera):
    path = _any(numbers, root)
    path.reparent_to(path.get_parent(), int(numbers.integers(-3, 3)))


CHANGES = {name[1:]: found for name, found in list(globals().items()) if name[0] == "_" and callable(found)}
for _helper in ("any", "piece"):
    del CHANGES[_helper]
