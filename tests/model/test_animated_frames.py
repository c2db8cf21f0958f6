"""Models that move, drawn: the pixels lie on the surfaces of plain loops, and nothing is a frame late."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from tests.conftest import make_renderer
from tests.model.figures import bending_tube, bulging_tube, make_model, posed_corners
from tests.scenes import geom_node, wall

SIZE = (96, 96)
FILM = 9.0
EYE = (0.0, -8.0, 1.5)
TIMES = (0.0, 0.35, 0.8, 1.4, 1.9)
MODELS = {
    "skin": bending_tube,
    "flat mirrored skin": lambda: bending_tube(flat=True, mirrored=True),
    "morphs": bulging_tube,
}
each_model = pytest.mark.parametrize("make", MODELS.values(), ids=MODELS)


def lit_scene(model):
    """A model over a floor, under a sun with shadows and a lamp."""
    scene = Scene()
    model.reparent_to(scene.root)
    floor = scene.root.attach_new_node(
        geom_node("floor", wall(20.0, 4), Material("floor", (0.6, 0.6, 0.5, 1)))
    )
    floor.set_hpr(0, -90, 0)
    floor.set_pos(0, 3, -1.5)
    sun = DirectionalLight("sun", (0.8, 0.8, 0.7))
    sun.set_direction((0.5, 0.6, -1.0))
    sun.set_shadow_caster(True, 256)
    scene.root.attach_new_node(sun)
    lamp = PointLight("lamp", (0.5, 0.6, 1.0), 12.0)
    lamp.set_shadow_caster(True, 128)
    scene.root.attach_new_node(lamp).set_pos(-2, 0, 4)
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.1, 0.1)))
    scene.camera.node().lens = OrthographicLens(film_size=(FILM, FILM), near=1, far=30)
    scene.camera.set_pos(*EYE)
    return scene


def distance_to_surface(points, triangles):
    """The distance of each point (n, 3) to the nearest of triangles (m, 3, 3), by Ericson's regions."""
    a, b, c = (triangles[None, :, k] for k in range(3))
    p = points[:, None]
    ab, ac = b - a, c - a
    normal = np.cross(ab, ac)
    area = (normal * normal).sum(axis=-1)
    v = (np.cross(p - a, ac) * normal).sum(axis=-1) / area
    w = (np.cross(ab, p - a) * normal).sum(axis=-1) / area
    inside = (v >= 0) & (w >= 0) & (v + w <= 1)
    plane = np.abs(((p - a) * normal).sum(axis=-1)) / np.sqrt(area)
    best = np.where(inside, plane, np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        t = np.clip(((p - start) * edge).sum(axis=-1) / (edge * edge).sum(axis=-1), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(p - start - t[..., None] * edge, axis=-1))
    return best.min(axis=1)


def coverage(triangles, rounding=1e-3):
    """Masks of the pixels whose centres fronts of triangles cover surely, and perhaps, seen along Y."""
    steps = (np.arange(SIZE[0]) + 0.5) / SIZE[0] * FILM - FILM / 2
    x, z = np.meshgrid(EYE[0] + steps, EYE[2] - steps)
    surely, perhaps = np.zeros((2, *SIZE), dtype=bool)
    for triangle in triangles[:, :, [0, 2]]:
        (ax, az), (bx, bz), (cx, cz) = triangle
        if (bx - ax) * (cz - az) - (bz - az) * (cx - ax) <= 0.0:
            continue  # clockwise: it faces away
        edges = [
            ((ux - tx) * (z - tz) - (uz - tz) * (x - tx)) / np.hypot(ux - tx, uz - tz)
            for (tx, tz), (ux, uz) in (
                ((ax, az), (bx, bz)),
                ((bx, bz), (cx, cz)),
                ((cx, cz), (ax, az)),
            )
        ]
        inside = np.min(edges, axis=0)
        surely |= inside > rounding
        perhaps |= inside > -rounding
    return surely, perhaps


@each_model
def test_drawn_positions_lie_on_the_posed_surface(make):
    data = make()
    scene = lit_scene(make_model(data))
    scene.root.find("floor").hide()
    with make_renderer(SIZE) as renderer:
        for time in TIMES:
            frame = renderer.render(scene, time, ("position_world", "id"))
            drawn = frame.position_world[frame.id >= 0].astype(np.float64)
            assert len(drawn) > 300
            posed = posed_corners(data, time)
            triangles = np.concatenate(
                [points[data.geoms[geom].arrays["triangles"]] for (_, geom), (points, _) in posed.items()]
            )
            size = np.ptp(triangles.reshape(-1, 3), axis=0).max()
            assert distance_to_surface(drawn, triangles).max() < 1e-5 * size
            is_mirrored = min(data.nodes[0].scale) < 0.0
            surely, perhaps = coverage(triangles[:, ::-1] if is_mirrored else triangles)
            assert (frame.id >= 0)[surely].all()
            assert not (frame.id >= 0)[~perhaps].any()


@each_model
def test_reuse_gives_the_bytes_of_a_fresh_renderer(make):
    scene = lit_scene(make_model(make()))
    outputs = ("color", "depth", "normal", "shadow_atlas")
    with make_renderer(SIZE, reuse=True) as renderer:
        seen = set()
        for time in (*TIMES, TIMES[1], TIMES[1]):
            frame = renderer.render(scene, time, outputs)
            with make_renderer(SIZE, reuse=False) as fresh:
                expected = fresh.render(lit_scene(make_model(make())), time, outputs)
            for name in outputs:
                assert np.array_equal(frame[name], expected[name]), (name, time)
            seen.add((frame.color.tobytes(), frame.shadow_atlas.tobytes()))
    assert len(seen) == len(TIMES)


def test_a_copy_beside_the_original_is_drawn_in_its_own_pose():
    model = make_model(bending_tube())
    scene = lit_scene(model)
    twin = copy.copy(model)
    twin.node().play("twist")
    twin.reparent_to(scene.root)
    twin.set_pos(-2, 0, 0)
    still = lit_scene(make_model(bending_tube()))
    for name, points in (("other", twin), ("one", model)):
        points.node().update(0.8)
        ((geom, material),) = points.find("tube").node().geoms
        fixed = Geom(geom.vertices, geom.triangles, geom.normals, name=name)
        still.root.attach_new_node(geom_node(name, fixed, material)).set_pos(points.get_pos())
    still.root.find("tube").remove_node()
    with make_renderer(SIZE) as renderer:
        assert np.array_equal(renderer.render(scene, 0.8).color, renderer.render(still, 0.8).color)
