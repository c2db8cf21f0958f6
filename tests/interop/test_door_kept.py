"""Nothing of a scene is converted again from frame to frame, and every change shows."""

from __future__ import annotations

import gc
import tracemalloc
import warnings
import weakref
from itertools import product

import moderngl
import numpy as np
import pyrender
import pytest
import trimesh
from pyrender import RenderFlags
from trimesh.transformations import rotation_matrix, scale_matrix, translation_matrix

import firefly_sample.interop.pyrender as door
from tests.gl_objects import count_objects
from tests.interop.door_parts import EYE, add_lights, add_shapes, at, card, look, picture, scene, textured

SIZE = (64, 48)
CHANGING = "Buffer", "VertexArray", "Texture"
"""Kinds of OpenGL objects that belong to scenes."""


@pytest.fixture(scope="module")
def kept():
    """A renderer that has drawn other scenes before."""
    with door.OffscreenRenderer(*SIZE) as made:
        yield made


@pytest.fixture(scope="module")
def unseen():
    """A renderer that has not drawn a test's scene before."""
    with door.OffscreenRenderer(*SIZE) as made:
        yield made


def room():
    """Things of several kinds, one below another, and a light of each kind."""
    made = add_lights(add_shapes(scene()), suns=1, lamps=1, spots=1)
    flat = textured({"baseColorTexture": pyrender.Texture(source=picture(), source_channels="RGB")})
    made.add(flat, name="card", pose=at(0.0, 1.2, turn=0.3), parent_name="box")
    poses = np.array([at(x, -0.6) for x in (-0.6, 0.6)])
    row = pyrender.Mesh.from_trimesh(trimesh.creation.icosphere(1, 0.25), material=look(), poses=poses)
    made.add(row, name="row", pose=at(0.0, 0.0, 1.0))
    return made


def named(made, name):
    (node,) = made.get_nodes(name=name)
    return node


def turn(made, frame):
    """Another pose of everything that has one."""
    for index, node in enumerate(sorted(made.mesh_nodes, key=lambda node: node.name)):
        made.set_pose(node, at(0.3 * index - 0.6, 0.2, turn=0.1 * frame + index))
    made.set_pose(made.main_camera_node, translation_matrix((0.02 * frame, 0, 6)))


def segments(made):
    return {node: index + 1 for index, node in enumerate(sorted(made.mesh_nodes, key=lambda node: node.name))}


def draw_all(renderer, made):
    """The colour and depth of a picture, and of a segmentation."""
    return *renderer.render(made), *renderer.render(made, RenderFlags.SEG, segments(made))


def test_sixty_poses_convert_and_upload_no_mesh(kept, monkeypatch):
    made, created = room(), []
    for frame in range(2):
        turn(made, frame)
        draw_all(kept, made)
    for kind in ("buffer", "texture", "depth_texture", "framebuffer", "vertex_array"):
        method = getattr(moderngl.Context, kind)

        def counted(self, *given, method=method, **named):
            created.append(method.__name__)
            return method(self, *given, **named)

        monkeypatch.setattr(moderngl.Context, kind, counted)
    converted, pictures = kept.converted_meshes, set()
    for frame in range(60):
        turn(made, frame)
        pictures.add(draw_all(kept, made)[0].tobytes())
    assert len(pictures) == 60
    assert kept.converted_meshes == converted
    assert created == []


FLAGS = [value for name, value in vars(RenderFlags).items() if name.isupper()]


@pytest.mark.parametrize("look_of_pictures", ["pyrender", "correct", "flat"])
def test_no_two_flags_convert_a_mesh_again(look_of_pictures):
    """Of meshes with normals and one without: any two flags, in any order."""
    made = add_shapes(scene())
    bare = pyrender.Primitive([(0, 0, 0), (1, 0, 0), (0, 1, 0)], mode=4, material=look())
    made.add(pyrender.Mesh([bare]), name="bare")
    primitives = {id(each) for node in made.mesh_nodes for each in node.mesh.primitives}
    with warnings.catch_warnings(), door.OffscreenRenderer(8, 6, look=look_of_pictures) as renderer:
        warnings.simplefilter("ignore")
        for first, second in product(FLAGS, repeat=2):
            renderer.render(made, first | second, segments(made))
            assert renderer.converted_meshes == len(primitives), (first, second)


@pytest.mark.parametrize("kind", ["directional", "spot"])
def test_a_shadow_map_is_drawn_once_while_masks_are_drawn_in_turn(kept, kind):
    made = add_lights(add_shapes(scene()), suns=kind == "directional", spots=kind == "spot")
    flag = RenderFlags.SHADOWS_DIRECTIONAL if kind == "directional" else RenderFlags.SHADOWS_SPOT
    drawn = []
    for frame in range(3):
        primitive(made).material.baseColorFactor = (0.1 * frame, 0.5, 0.5, 1.0)
        kept.render(made, flag)
        drawn.append(kept._renderer._passes["shadow_maps"].drawn)
        kept.render(made, RenderFlags.SEG, segments(made))
    assert drawn == [1, 0, 0]


def test_memory_stays_over_a_loop_of_poses(kept):
    made = room()

    def held(frames):
        for frame in frames:
            turn(made, frame)
            kept.render(made)
        gc.collect()
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        settled = held(range(20))
        assert held(range(20, 60)) - settled < 2**15  # a picture has 9 KiB, so that all have 360
    finally:
        tracemalloc.stop()


def primitive(made, name="ball"):
    (only,) = named(made, name).mesh.primitives
    return only


def replace_positions(made):
    primitive(made).positions = 1.3 * primitive(made).positions


def replace_normals(made):
    primitive(made).normals = primitive(made).normals[:, ::-1]


def replace_indices(made):
    primitive(made).indices = primitive(made).indices[: len(primitive(made).indices) // 2]


def give_colors(made):
    primitive(made).color_0 = np.random.default_rng(1).uniform(size=primitive(made).positions.shape)


def replace_texcoords(made):
    primitive(made, "card").texcoord_0 = 2.5 * primitive(made, "card").texcoord_0


def replace_instances(made):
    primitive(made, "row").poses = np.array([at(x, 0.6) for x in (-0.8, 0.1, 0.8)])


def replace_material(made):
    primitive(made).material = look((0.1, 0.9, 0.2, 1.0))


def replace_color(made):
    primitive(made).material.baseColorFactor = (0.1, 0.2, 0.9, 1.0)


def change_color_in_place(made):
    primitive(made).material.baseColorFactor[0] = 0.1


def change_metalness(made):
    primitive(made).material.metallicFactor = 0.9


def change_emission(made):
    primitive(made).material.emissiveFactor = (0.5, 0.6, 0.1)


def make_wireframe(made):
    primitive(made).material.wireframe = True


def make_clear(made):
    material = primitive(made).material
    material.alphaMode, material.baseColorFactor = "BLEND", (0.8, 0.5, 0.3, 0.4)


def show_backs(made):
    primitive(made).material.doubleSided = True
    replace_indices(made)


def replace_texture(made):
    image = pyrender.Texture(source=picture(seed=2), source_channels="RGB")
    primitive(made, "card").material.baseColorTexture = image


def replace_image(made):
    primitive(made, "card").material.baseColorTexture.source = picture(seed=3)


def replace_sampler(made):
    nearest = pyrender.Sampler(magFilter=pyrender.GLTF.NEAREST, minFilter=pyrender.GLTF.NEAREST)
    primitive(made, "card").material.baseColorTexture.sampler = nearest


def remove_texture(made):
    primitive(made, "card").material.baseColorTexture = None


def remove_node(made):
    made.remove_node(named(made, "box"))  # and what is below it


def add_node(made):
    mesh = pyrender.Mesh.from_trimesh(trimesh.creation.box((0.5, 0.5, 0.5)), smooth=False)
    made.add(mesh, name="new", pose=at(1.0, -1.0), parent_name="ring")


def replace_mesh(made):
    named(made, "ball").mesh = named(made, "ring").mesh


def add_primitive(made):
    mesh = named(made, "ball").mesh
    mesh.primitives = [*mesh.primitives, *pyrender.Mesh.from_trimesh(card(picture())).primitives]


def hide_mesh(made):
    named(made, "ball").mesh.is_visible = False


def move_node(made):
    made.set_pose(named(made, "box"), at(0.5, 0.5))


def move_by_translation(made):
    named(made, "ball").translation = 0.3, 0.2, 0.0


def mirror_node(made):
    made.set_pose(named(made, "ring"), at(0.5, 0.5) @ np.diag((-1.0, 1.0, 1.0, 1.0)))


def shrink_node(made):
    made.set_pose(named(made, "ring"), at(0.5, 0.5) @ scale_matrix(0.5))


def reparent_node(made):
    moved = named(made, "card")
    made.remove_node(moved)
    made.add_node(moved, parent_node=named(made, "ring"))


def brighten_light(made):
    (sun,) = made.directional_lights
    sun.intensity *= 2.0


def recolor_light_in_place(made):
    (lamp,) = made.point_lights
    lamp.color[1] *= 0.5


def narrow_spotlight(made):
    (spot,) = made.spot_lights
    spot.innerConeAngle, spot.outerConeAngle = 0.05, 0.1


def move_light(made):
    (node,) = made.point_light_nodes
    made.set_pose(node, translation_matrix((-2, 1, 3)))


def replace_light(made):
    (node,) = made.point_light_nodes
    node.light = pyrender.DirectionalLight(intensity=2.0)


def add_light(made):
    made.add(pyrender.PointLight(intensity=20.0), pose=translation_matrix((0, 2, 3)))


def remove_light(made):
    (node,) = made.directional_light_nodes
    made.remove_node(node)


def change_ambient_light(made):
    made.ambient_light = (0.4, 0.3, 0.5)


def change_background(made):
    made.bg_color = (0.9, 0.1, 0.2)


def move_camera(made):
    made.set_pose(made.main_camera_node, rotation_matrix(0.2, (0, 1, 0)) @ EYE)


def change_camera(made):
    made.main_camera_node.camera.yfov = 0.5


def replace_camera(made):
    made.main_camera_node.camera = pyrender.OrthographicCamera(2.0, 2.0)


def choose_camera(made):
    made.main_camera_node = made.add(pyrender.PerspectiveCamera(1.0), pose=EYE)


CHANGES = [
    *(replace_positions, replace_normals, replace_indices, give_colors, replace_texcoords, replace_instances),
    *(replace_material, replace_color, change_color_in_place, change_metalness, change_emission),
    *(make_wireframe, make_clear, show_backs),
    *(replace_texture, replace_image, replace_sampler, remove_texture),
    *(remove_node, add_node, replace_mesh, add_primitive, hide_mesh),
    *(move_node, move_by_translation, mirror_node, shrink_node, reparent_node),
    *(brighten_light, recolor_light_in_place, narrow_spotlight, move_light, replace_light, add_light),
    *(remove_light, change_ambient_light, change_background),
    *(move_camera, change_camera, replace_camera, choose_camera),
]


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_shows_in_the_next_frame(kept, unseen, change):
    """Its bytes are those of a scene that has never been drawn otherwise."""
    made, anew = room(), room()
    before = draw_all(kept, made)
    change(made)
    after = draw_all(kept, made)
    assert (after[0] != before[0]).any()
    change(anew)
    for own, wanted in zip(after, draw_all(unseen, anew), strict=True):
        assert (own == wanted).all()


def test_changes_show_one_after_the_other(kept):
    made = room()
    for change in CHANGES:
        if change is not remove_node:  # which takes along what others change
            change(made)
            own = draw_all(kept, made)
    with door.OffscreenRenderer(*SIZE) as fresh:
        wanted = draw_all(fresh, made)
    assert all((one == other).all() for one, other in zip(own, wanted, strict=True))


def test_a_scene_that_is_gone_is_kept_by_nobody(kept):
    other = add_shapes(scene())

    def objects():
        for _ in range(2):
            draw_all(kept, other)
            gc.collect()
        return {kind: count for kind, count in count_objects(kept._renderer).items() if kind in CHANGING}

    before = objects()
    made = room()
    draw_all(kept, made)
    card_of = primitive(made, "card")
    things = made, *made.nodes, *made.meshes, *made.lights, card_of, card_of.material
    gone = [weakref.ref(thing) for thing in (*things, card_of.material.baseColorTexture)]
    del made, card_of, things
    gc.collect()
    assert [reference() for reference in gone if reference() is not None] == []
    assert objects() == before


def test_what_leaves_a_scene_is_kept_by_nobody(kept):
    """Not even by what was kept for drawings of another kind."""
    made = room()
    draw_all(kept, made)
    gone = [weakref.ref(thing) for node in made.get_nodes(name="ring") for thing in (node, node.mesh)]
    made.remove_node(named(made, "ring"))
    kept.render(made)
    gc.collect()
    assert [reference() for reference in gone if reference() is not None] == []
