"""Shadows by rays: hard edges where they must be, and what stands in the way of which light."""

import numpy as np
import pytest

from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.lab.reference.shade import each_light
from firefly_sample.lab.reference.shadow import CONTACT, ShadowRays
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.texture import Texture
from tests.lab.float64 import plan_of
from tests.scenes import geom_node, wall
from tests.shadows import KINDS, occluded, outside_hull, shadowed_scene, world_triangles

PLACES = {"sun": (-5.0, 4.0, 5.0), "spot": (3.0, -2.0, 6.0), "point": (2.5, -1.5, 5.0)}


def looked_up(scene, size=(120, 90)):
    """The plan's only light, surfaces in view, and which of them it reaches."""
    plan = plan_of(scene, size)
    surfaces = see_surfaces(plan, cast_visibility(plan))
    (one,) = each_light(plan.lights)
    points = surfaces.gbuffer.position[surfaces.covered]
    normals = surfaces.gbuffer.normal[surfaces.covered]
    world = points @ plan.view.view_to_world[:3, :3] + plan.view.view_to_world[3, :3]
    return plan, one, points, normals, world, ShadowRays(plan).lit(points, one)


@pytest.mark.parametrize("kind", KINDS)
def test_a_boxs_shadow_ends_exactly_where_it_must(kind):
    scene = shadowed_scene(kind, PLACES[kind])
    _, _, _, _, world, lit = looked_up(scene)
    path = scene.root.find("box")
    matrix = path.get_net_transform().get_mat()
    corners = path.node().geoms[0][0].vertices @ matrix[:3, :3] + matrix[3, :3]
    light = np.array(PLACES[kind])
    toward = np.broadcast_to(light, corners.shape) if kind == "sun" else light - corners
    shadow = corners - toward * (corners[:, 2:] / toward[:, 2:])
    floor = np.abs(world[:, 2]) < 1e-9
    away = outside_hull(world[floor, :2], shadow[:, :2])
    # float32 finds the candidates; a few 1e-6 of the distances are its to err
    clear = np.abs(away) > 2e-5
    assert (lit[floor] == (away > 0))[clear].all()
    assert clear.mean() > 0.999
    assert 0.02 < 1 - lit[floor].mean() < 0.5


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("thing", ["box", "ball"])
def test_every_pixel_agrees_with_float64_rays_through_all_triangles(kind, thing):
    scene = shadowed_scene(kind, PLACES[kind], thing=thing)
    _, _, points, normals, world, lit = looked_up(scene, (44, 33))
    light = np.array(PLACES[kind])
    way = np.broadcast_to(light, world.shape) if kind == "sun" else light - world
    length = np.linalg.norm(way, axis=1)
    way = way / length[:, None]
    distance = np.full(len(world), np.inf) if kind == "sun" else length
    exact = occluded(world, way, distance, world_triangles(scene), chunk=400)
    differs = (lit == 0) != exact
    # at a corner or an edge a ray may touch; and what is nearer than the contact is no shadow
    assert differs.mean() <= 2e-3
    assert len(points) == len(normals)
    assert CONTACT < 1e-5


def test_light_comes_through_what_alpha_cuts_away():
    pixels = np.full((8, 8, 4), 255, dtype=np.uint8)
    pixels[:, :4, 3] = 0
    leaf = Material("leaf", texture=Texture(pixels), alpha_mode="mask", double_sided=True)
    scene = shadowed_scene("sun", (0.0, 0.0, 6.0))
    scene.root.find("box").detach_node()
    leaves = scene.root.attach_new_node(geom_node("leaf", wall(4.0), leaf))
    leaves.set_pos(0, 0, 2)
    leaves.set_p(-90)
    _, _, _, _, world, lit = looked_up(scene)
    x, y, z = world.T
    below = (np.abs(z) < 1e-9) & (np.abs(y) < 1.99)
    assert (lit[below & (x > 0.01) & (x < 1.99)] == 0).all()
    assert (lit[below & (x < -0.01)] == 1).all()
    assert (below & (lit == 0)).sum() > 100


def test_what_the_camera_does_not_see_casts_a_shadow_too():
    scene = shadowed_scene("sun", (0.0, -20.0, 20.0))
    scene.root.find("box").set_pos(0.0, -20.0, 20.0)
    plan, _, _, _, _, lit = looked_up(scene)
    assert not any("box" in plan.id_names[i] for batch in plan.batches for i in batch.ids)
    assert (lit == 0).sum() > 20


def test_beyond_its_shadow_distance_a_sun_casts_none():
    scene = shadowed_scene("sun", (3.0, -2.0, 6.0))
    node = scene.root.find("light").node()
    assert isinstance(node, DirectionalLight)
    node.set_shadow_distance(4.0)
    _, _, _, _, _, lit = looked_up(scene)
    assert (lit == 1).all()
