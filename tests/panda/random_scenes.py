"""Random Panda3D scenes. The same seed gives the same scene in each process."""

from __future__ import annotations

from zlib import crc32

import numpy as np
from panda3d import core

from tests.panda.random_shapes import ball, card, model
from tests.panda.scenes import ASPECT

MODELS = "models/misc/smiley.egg.pz", "models/jack.egg.pz", "models/box.egg.pz"
_TEXTURE, _STAGE, _BLENDING = core.Texture, core.TextureStage, core.TransparencyAttrib
CELLS = [(x, z) for x in (-3, 0, 3) for z in (-1.6, 1.6)]
"""Where the pieces stand, which keeps those that blend apart."""


class Choices:
    """Named choices by a seed, each with random numbers of its own.

    A choice that is ruled out by name leaves all others as they are, to find the smallest scene with a fault.
    """

    def __init__(self, seed: int, without: tuple[str, ...] = ()) -> None:
        self._seed, self._without = seed, without
        self._counts: dict[str, int] = {}
        self.made: set[str] = set()
        self.flat = self.maybe("flatten", 0.15) is not None
        self.brightest = 1.0 if self.flat else 1.3  # flattened colours are cut off at 1

    def numbers(self, name: str) -> np.random.Generator:
        count = self._counts[name] = self._counts.get(name, 0) + 1
        return np.random.default_rng((self._seed, crc32(name.encode()), count))

    def maybe(self, name: str, chance: float) -> np.random.Generator | None:
        """Random numbers for a feature, or None where it is not there."""
        numbers = self.numbers(name)
        if numbers.random() >= chance or name in self._without:
            return None
        self.made.add(name)
        return numbers


def build(seed: int, without: tuple[str, ...] = ()) -> tuple[core.NodePath, core.NodePath]:
    """A root and a camera."""
    choices = Choices(seed, without)
    above = core.NodePath("above")
    if numbers := choices.maybe("state above", 0.3):
        above.set_color_scale(*numbers.uniform(0.6, 1, 3), 1)
    if numbers := choices.maybe("transform above", 0.3):
        above.set_pos_hpr(*numbers.uniform(-1, 1, 3), *numbers.uniform(-60, 60, 3))
    root = above.attach_new_node("render")
    branches = [root]
    for index in range(2):
        branch = branches[-1].attach_new_node(f"branch {index}")
        if numbers := choices.maybe("branch", 0.5):
            branch.set_hpr(*numbers.uniform(-20, 20, 3))
        branches.append(branch)
    blended = choices.numbers("blended").integers(2 * len(CELLS))
    for index, (x, z) in enumerate(CELLS):
        if not choices.maybe(f"piece {index}", 0.75):
            continue
        piece = add_piece(choices, index, index == blended)
        place(choices, piece, root, branches, x, z)
    add_lights(choices, root, branches)
    camera = add_camera(choices, root, branches)
    if choices.flat:
        root.flatten_strong()
    if choices.maybe("bam", 0.15):
        root, camera = through_bam(root, camera)
    return root, camera


def place(choices, piece, root, branches, x, z) -> None:
    """Put a piece in a cell, below one of the branches, behind a chain of transforms."""
    parent = branches[choices.numbers("parent").integers(len(branches))]
    holder = parent.attach_new_node("holder")
    holder.set_pos(root, x, 0, z)
    holder.set_hpr(root, 0, 0, 0)
    if numbers := choices.maybe("turn", 0.8):
        holder.set_hpr(root, *numbers.uniform(-60, 60, 3))
    if numbers := choices.maybe("scale", 0.5):
        holder.set_scale(*numbers.uniform(0.6, 1.3, 3))
    if numbers := choices.maybe("shear", 0.3):
        holder.set_shear(*numbers.uniform(-0.4, 0.4, 3))
    if choices.maybe("mirror", 0.2):
        holder.set_sx(-holder.get_sx())
    if numbers := choices.maybe("switch", 0.1):
        switch = core.SwitchNode("switch")
        path = holder.attach_new_node(switch)
        small(choices).reparent_to(path)
        piece.reparent_to(path)
        switch.set_visible_child(int(numbers.integers(2)))
    elif numbers := choices.maybe("lod", 0.15):
        levels = core.LODNode("levels")
        path = holder.attach_new_node(levels)
        piece.reparent_to(path)
        small(choices).reparent_to(path)
        distance = numbers.uniform(8, 16)
        levels.add_switch(distance, 0)
        levels.add_switch(1000, distance)
    else:
        piece.reparent_to(holder)
    if choices.maybe("hide", 0.07):
        holder.hide()
    if numbers := choices.maybe("mask", 0.15):
        holder.hide(core.BitMask32(int(numbers.integers(1, 8))))
    if numbers := choices.maybe("show through", 0.1):
        piece.show_through(core.BitMask32(int(numbers.integers(1, 8))))
    if choices.maybe("stash", 0.05):
        holder.stash()
    if numbers := choices.maybe("holder color", 0.15):
        holder.set_color(*numbers.uniform(0, 1, 3), 1, int(numbers.integers(0, 3)))
    if numbers := choices.maybe("holder scale", 0.2):
        holder.set_color_scale(*numbers.uniform(0.3, choices.brightest, 3), 1, int(numbers.integers(0, 2)))
    if choices.maybe("light off", 0.12):
        holder.set_light_off(int(choices.numbers("light off priority").integers(0, 2)))
    if numbers := choices.maybe("billboard", 0.12):
        [holder.set_billboard_point_eye, holder.set_billboard_point_world, holder.set_billboard_axis][
            numbers.integers(3)
        ]()
    if numbers := choices.maybe("instance", 0.1):
        other = root.attach_new_node("other")
        other.set_pos(x, 1.5, z + 0.7)
        other.set_scale(0.4)
        if choices.maybe("instance color", 0.5):
            other.set_color(*numbers.uniform(0, 1, 3), 1, 1)
        piece.instance_to(other)


def small(choices) -> core.NodePath:
    """Another look of a piece: a small ball."""
    path = core.NodePath(ball(False, 6))
    path.set_scale(0.5)
    path.set_color(*choices.numbers("small").uniform(0.2, 1, 3), 1)
    return path


def add_piece(choices, index: int, blended: bool) -> core.NodePath:
    """Geometry with a state of its own."""
    numbers = choices.numbers("kind")
    kind = numbers.integers(5)
    by_vertices = choices.flat
    if blended or kind < 2:
        coloured = bool(choices.maybe("vertex colors", 0.4))
        by_vertices |= coloured
        node = card(coloured) if kind == 0 else ball(coloured, 12)
        piece = core.NodePath(node)
    elif kind == 2 and choices.maybe("text", 0.6):
        text = core.TextNode("text")
        text.set_text("fire\nfly")
        text.set_align(text.A_center)
        text.set_text_color(*numbers.uniform(0.2, 1, 3), 1)
        piece = core.NodePath(text)
        piece.set_light_off()
        return piece
    else:
        piece = model(MODELS[numbers.integers(len(MODELS))])
    if numbers := choices.maybe("color", 0.3):
        piece.set_color(*numbers.uniform(0, 1, 3), 1, int(numbers.integers(0, 2)))
    elif choices.maybe("color off", 0.1):
        piece.set_color_off(1)
    if numbers := choices.maybe("color scale", 0.25):
        piece.set_color_scale(*numbers.uniform(0, choices.brightest, 3), 1)
    if choices.maybe("material", 0.5):
        piece.set_material(
            material(choices, by_vertices), int(choices.numbers("material priority").integers(0, 2))
        )
    if choices.maybe("texture", 0.5):
        textured(choices, piece, blended)
    elif choices.maybe("texture off", 0.1):
        piece.set_texture_off(1)
    if choices.maybe("two sided", 0.3) and not blended:
        piece.set_two_sided(True)
    elif choices.maybe("reverse", 0.1):
        piece.set_attrib(core.CullFaceAttrib.make_reverse())
    if choices.maybe("wireframe", 0.05) and not blended:  # wires lie on each other
        piece.set_render_mode_wireframe()
    if numbers := choices.maybe("depth offset", 0.1):
        piece.set_depth_offset(int(numbers.integers(-2, 3)))
    if blended:
        if numbers := choices.maybe("blend", 1):
            piece.set_transparency([_BLENDING.M_alpha, _BLENDING.M_dual][numbers.integers(2)], 1)
            piece.set_alpha_scale(numbers.uniform(0.3, 1))
    elif choices.maybe("binary", 0.15):
        piece.set_transparency(_BLENDING.M_binary, 1)
    elif numbers := choices.maybe("alpha test", 0.1):
        piece.set_transparency(_BLENDING.M_none, 1)
        attrib = core.AlphaTestAttrib.make(core.RenderAttrib.M_greater, numbers.uniform(0.1, 0.9))
        piece.set_attrib(attrib)
    else:
        piece.set_transparency(_BLENDING.M_none, 1)
    if numbers := choices.maybe("geom state", 0.25):
        for path in (piece, *piece.find_all_matches("**")):
            node = path.node()
            if isinstance(node, core.GeomNode):
                for part in range(node.get_num_geoms()):
                    attrib = core.ColorAttrib.make_flat((*numbers.uniform(0, 1, 3), 1))
                    node.set_geom_state(part, node.get_geom_state(part).set_attrib(attrib))
    return piece


def material(choices, by_vertices: bool) -> core.Material:
    """A material. Colours of vertices stand for both its ambient and its diffuse colour or for neither."""
    made = core.Material("material")
    for name, chance in (("ambient", 0.5), ("diffuse", 0.6), ("emission", 0.3), ("specular", 0.5)):
        if numbers := choices.maybe(name, chance):
            top = 0.3 if name == "emission" else 1.0
            getattr(made, f"set_{name}")((*numbers.uniform(0, top, 3), 1))
    if by_vertices and made.has_ambient() != made.has_diffuse():
        made.clear_ambient()
        made.clear_diffuse()
    if numbers := choices.maybe("shininess", 0.8):
        made.set_shininess(numbers.choice([0.5, 1, 5, 20, 80]))
    if choices.maybe("local", 0.5):
        made.set_local(True)
    if numbers := choices.maybe("base color", 0.1):
        made.set_base_color((*numbers.uniform(0, 1, 3), 1))
        if choices.maybe("metallic", 0.5):
            made.set_metallic(numbers.random())
        if choices.maybe("roughness", 0.5):
            made.set_roughness(numbers.uniform(0.1, 1))
    return made


def textured(choices, piece, blended: bool) -> None:
    """Give a piece one texture or two."""
    stages = [_STAGE.get_default()]
    if choices.maybe("second stage", 0.35):
        second = _STAGE("second")
        second.set_sort(1)
        if choices.maybe("second uv", 0.6):
            second.set_texcoord_name("second")
        stages.append(second)
    for stage in stages:
        piece.set_texture(stage, texture(choices), 1)
        if numbers := choices.maybe("tex offset", 0.3):
            piece.set_tex_offset(stage, *numbers.uniform(-1, 1, 2))
        if numbers := choices.maybe("tex scale", 0.3):
            piece.set_tex_scale(stage, *numbers.uniform(0.5, 2, 2))
        if numbers := choices.maybe("tex rotate", 0.2):
            piece.set_tex_rotate(stage, numbers.uniform(-90, 90))


FORMATS = {
    _TEXTURE.F_rgb: 3,
    _TEXTURE.F_rgba: 4,
    _TEXTURE.F_luminance: 1,
    _TEXTURE.F_luminance_alpha: 2,
    _TEXTURE.F_alpha: 1,
    _TEXTURE.F_rgb5: 3,
    _TEXTURE.F_rgba4: 4,
    _TEXTURE.F_red: 1,
    _TEXTURE.F_rg: 2,
}


def texture(choices) -> core.Texture:
    """Noise, large enough for pictures that agree at the edges of texels, too."""
    numbers = choices.numbers("texels")
    made = core.Texture("noise")
    kinds = list(FORMATS)
    kind = kinds[numbers.integers(len(kinds))] if choices.maybe("format", 0.6) else _TEXTURE.F_rgba
    width, height = (int(size) for size in numbers.choice([2, 4, 5, 8], 2))
    made.setup_2d_texture(width, height, _TEXTURE.T_unsigned_byte, kind)
    made.set_ram_image(numbers.integers(0, 256, (height, width, FORMATS[kind]), dtype=np.uint8).tobytes())
    wraps = [core.SamplerState.WM_repeat, core.SamplerState.WM_clamp, core.SamplerState.WM_mirror]
    if choices.maybe("wrap", 0.6):
        made.set_wrap_u(wraps[numbers.integers(3)])
        made.set_wrap_v(wraps[numbers.integers(3)])
    if choices.maybe("nearest", 0.3):
        made.set_magfilter(core.SamplerState.FT_nearest)
        made.set_minfilter(core.SamplerState.FT_nearest)
    elif choices.maybe("mipmap", 0.2):
        made.set_minfilter(core.SamplerState.FT_linear_mipmap_linear)
    return made


def add_lights(choices, root, branches) -> None:
    """Lights of all kinds, in any branch; all are set on for all."""
    lights = []
    for index in range(2):
        if numbers := choices.maybe("ambient light", 0.6):
            node = core.AmbientLight(f"ambient {index}")
            node.set_color((*numbers.uniform(0, 0.3, 3), 1))
            lights.append(root.attach_new_node(node))
    for index in range(2):
        if numbers := choices.maybe("sun", 0.5):
            node = core.DirectionalLight(f"sun {index}")
            node.set_color((*numbers.uniform(0, 0.6, 3), 1))
            if choices.maybe("direction", 0.3):
                node.set_direction(core.LVector3(*numbers.uniform(-1, 1, 3)))
            path = branches[numbers.integers(len(branches))].attach_new_node(node)
            path.set_hpr(*numbers.uniform(-180, 180, 2), 0)
            if choices.maybe("scaled sun", 0.3):
                path.set_scale(*numbers.uniform(0.5, 2, 3))
            lights.append(path)
    for index in range(3):
        if numbers := choices.maybe("lamp", 0.5):
            node = core.PointLight(f"lamp {index}")
            node.set_color((*numbers.uniform(0, 1, 3), 1))
            if choices.maybe("attenuation", 0.6):
                node.set_attenuation(core.LVecBase3(1, *numbers.uniform(0, 0.2, 2)))
            path = branches[numbers.integers(len(branches))].attach_new_node(node)
            path.set_pos(root, *numbers.uniform(-4, 4, 3))
            if choices.maybe("scaled lamp", 0.2):
                path.set_scale(*numbers.uniform(0.5, 2, 3))
            lights.append(path)
    for index in range(2):
        if numbers := choices.maybe("spot", 0.4):
            node = core.Spotlight(f"spot {index}")
            node.set_color((*numbers.uniform(0, 1.5, 3), 1))
            node.get_lens().set_fov(numbers.uniform(10, 100))
            if choices.maybe("spot aspect", 0.3):
                node.get_lens().set_fov(numbers.uniform(10, 60), numbers.uniform(10, 60))
            if choices.maybe("exponent", 0.7):
                node.set_exponent(numbers.choice([0, 1, 5, 50]))
            if choices.maybe("attenuation", 0.6):
                node.set_attenuation(core.LVecBase3(1, *numbers.uniform(0, 0.2, 2)))
            path = branches[numbers.integers(len(branches))].attach_new_node(node)
            path.set_pos(root, numbers.uniform(-3, 3), -6, numbers.uniform(-3, 3))
            path.look_at(root, *numbers.uniform(-2, 2, 3))
            lights.append(path)
    for path in lights:
        if path.node().is_of_type(core.LightLensNode) and choices.maybe("specular color", 0.2):
            path.node().set_specular_color((*choices.numbers("highlight").uniform(0, 1, 3), 1))
        if choices.maybe("hidden light", 0.15):
            path.hide()
        if choices.maybe("far light", 0.1):
            path.wrt_reparent_to(core.NodePath("elsewhere"))
        root.set_light(path)


def add_camera(choices, root, branches) -> core.NodePath:
    """A camera that sees all cells."""
    node = core.Camera("camera")
    numbers = choices.numbers("lens")
    lens = core.PerspectiveLens()
    lens.set_fov(50)
    if choices.maybe("orthographic", 0.2):
        lens = core.OrthographicLens()
        lens.set_film_size(12)
    lens.set_aspect_ratio(ASPECT)
    lens.set_near_far(1, 60)
    if choices.maybe("film offset", 0.2):
        lens.set_film_offset(*(numbers.uniform(-0.1, 0.1, 2) * lens.get_film_size()))
    if choices.maybe("matrix lens", 0.15):
        projection = lens.get_projection_mat()
        lens = core.MatrixLens()
        lens.set_user_mat(projection)
    node.set_lens(lens)
    if choices.maybe("camera mask", 0.3):
        node.set_camera_mask(core.BitMask32(int(numbers.integers(1, 8))))
    if choices.maybe("camera state", 0.15):
        made = core.NodePath("initial")
        made.set_color_scale(0.8, 0.9, 0.7, 1)
        if choices.maybe("camera override", 0.5):
            made.set_color((0.3, 0.6, 0.9, 1), 5)
        node.set_initial_state(made.get_state())
    if choices.maybe("camera elsewhere", 0.2):
        path = core.NodePath(node)
        node.set_scene(root.get_top())
    else:
        path = branches[numbers.integers(len(branches))].attach_new_node(node)
    path.set_pos(root, *numbers.uniform(-3, 3, 1), -12, *numbers.uniform(-3, 3, 1))
    path.look_at(root, 0, 0, 0)
    if choices.maybe("camera elsewhere wrt", 1) and not path.has_parent():
        path.set_mat(path.get_mat(root) * root.get_net_transform().get_mat())
    return path


def through_bam(root, camera):
    """The scene as a .bam file keeps it. A camera of another graph stays."""
    data = core.NodePath(root.get_top().node()) if camera.get_top() == root.get_top() else root
    below = root.get_top() == camera.get_top()
    made = core.NodePath.decode_from_bam_stream(data.encode_to_bam_stream())
    if made.get_name() == "render":
        camera.node().set_scene(made)
        return made, camera
    return made.find("render"), made.find("**/+Camera") if below else camera
