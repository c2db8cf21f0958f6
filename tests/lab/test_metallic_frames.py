"""Frames of metallic-roughness materials, with every map, against the float64 reference."""

import numpy as np

from firefly_sample.lab.reference.cache import reference_frame
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.lab.float64 import edges
from tests.lit_scenes import lit_scene
from tests.scenes import ball, geom_node

EXACT = Settings(cutoff_budget=0.0, albedo_format="rgba32f", normal_format="rgba32f")
SIZE = (160, 120)


def noise(seed, low=0, **sampling):
    pixels = np.random.default_rng(seed).integers(low, 256, (8, 8, 4), dtype=np.uint8)
    return Texture(pixels, **sampling)


def bumps(**sampling):
    """Normals that lean at random, but for a half of the length at most."""
    lean = np.random.default_rng(9).uniform(-0.5, 0.5, (8, 8, 2))
    pixels = np.full((8, 8, 4), 255, dtype=np.uint8)
    pixels[..., :2] = np.rint((lean + 1) * 127.5)
    return Texture(pixels, **sampling)


def placed(geom):
    """The geom with tangents, and with two sets of texture coordinates."""
    places = geom.vertices[:, [0, 2]] + 0.1 * geom.vertices[:, [1]]
    tangents = np.cross(geom.normals, (0.3, 0.8, 0.5))
    tangents = np.column_stack([tangents, np.where(geom.vertices[:, 0] < 0, -1.0, 1.0)])
    return Geom(
        geom.vertices,
        geom.triangles,
        geom.normals,
        0.3 * places,
        texcoords_1=0.7 * places[:, ::-1],
        tangents=tangents,
    )


def metal_scene(**sampling):
    """Balls and a floor of metals, a Phong ball with maps, and one that is unlit."""
    scene = lit_scene(("ramp", "attenuated", "sun", "spots"))
    scene.root.attach_new_node(AmbientLight("sky", (0.2, 0.3, 0.4)))
    maps = {
        "normal_texture": bumps(**sampling),
        "normal_scale": 0.8,
        "occlusion_texture": noise(2, **sampling),
        "occlusion_strength": 0.7,
    }
    rough = noise(1, 90, **sampling)
    brass = Material(
        "brass",
        (0.9, 0.7, 0.3, 1.0),
        texture=noise(4, 100, **sampling),
        metallic=1.0,
        roughness=0.9,
        metallic_roughness_texture=rough,
        metallic_roughness_texcoord=1,
        normal_texcoord=1,
        double_sided=True,
        **maps,
    )
    earth = Material(
        "earth", (0.5, 0.4, 0.3, 1.0), metallic=0.2, roughness=0.6, metallic_roughness_texture=rough
    )
    clay = Material("clay", (0.5, 0.5, 0.5, 1.0), specular=(0.2, 0.2, 0.2), shininess=9.0, **maps)
    sign = Material("sign", (0.9, 0.2, 0.1, 1.0), texture=noise(5, **sampling), unlit=True)
    floor = scene.root.find("floor").node()
    floor.geoms[:] = [(geom, earth) for geom, _ in floor.geoms]
    for index, material in enumerate((brass, clay, sign)):
        path = scene.root.find(f"place {index}")
        for child in path.get_children():
            child.detach_node()
        path.attach_new_node(geom_node(material.name, placed(ball()), material))
    scene.root.find("place 1").set_scale(-0.8, 0.9, 1.0)
    return scene


def test_a_frame_is_its_reference(tmp_path):
    """With what the GPU samples of textures, and targets of float32, only float32's rounding is left."""
    scene = metal_scene()
    with make_renderer(SIZE, EXACT) as renderer:
        reference = reference_frame(renderer, scene, folder=tmp_path)
        frame = renderer.render(scene, outputs=("radiance", "metallic"))
    apart = np.abs(frame["radiance"] - reference.radiance).max(axis=-1)
    apart /= np.percentile(reference.radiance, 99.9)
    assert len(np.unique(frame["metallic"])) > 1000
    assert np.percentile(apart, 99.9) <= 1e-5


def test_maps_are_sampled_as_the_gpu_does():
    """Nearest texels, whose filtering has no error: but for their borders all is equal."""
    scene = metal_scene(minfilter="nearest", magfilter="nearest")
    with make_renderer(SIZE, EXACT) as renderer:
        plan = renderer.plan(
            scene, 0.0, ("visibility", "albedo", "normal", "metallic", "radiance", "emission")
        )
        frame = renderer.draw(plan)
        surface = renderer.surface(plan)
        drawn, ambient = surface.gbuffer(), surface.ambient_albedo()
    visibility = frame["visibility"]
    seen = see_surfaces(plan, visibility)
    inside = seen.covered & ~edges(visibility)
    pairs = {
        "normal": (drawn.normal, seen.gbuffer.normal),
        "metallic": (drawn.metallic, seen.gbuffer.metallic),
        "roughness": (drawn.roughness, seen.gbuffer.roughness),
        "albedo": (drawn.albedo, seen.gbuffer.albedo),
        "ambient": (ambient, seen.ambient_albedo),
        "emission": (frame["emission"], seen.emission),
    }
    for name, (one, other) in pairs.items():
        apart = np.abs(one - other).reshape(*inside.shape, -1).max(axis=-1)[inside]
        assert np.percentile(apart, 99) <= 1e-5, name  # half a code of sixteen bits is 7.6e-6
