"""Plans ask for no other variants than those that a test compiles."""

from dataclasses import asdict, replace
from functools import cache
from itertools import product
from random import Random

import numpy as np
import pytest

from firefly_sample.frame import OUTPUTS
from firefly_sample.passes.legal import as_products
from firefly_sample.passes.lights import variant_for
from firefly_sample.pipeline import PASSES
from firefly_sample.plan.build import MISSING
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.plan.lights.light_set import PASS_OF_KIND
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import VerticalGradient
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.scenes import geom_node, new_planner, orthographic_wall, wall, wall_scene

SCENES = (wall_scene, orthographic_wall)
MATERIALS = ("plain", "leaf", "bark", "tile")
DRIVERS = (Capabilities(), Capabilities(clip_control=False, snorm_targets=False))
OUTPUT_SETS = (
    ("color",),
    ("radiance",),
    ("depth", "normal"),
    ("color", "id"),
    ("light",),
    ("light", "radiance"),
    ("overdraw", "volumes", "wireframe", "shadow_atlas"),
)
PLACES = {
    "look": ("correct", "classic", "pyrender", "flat", "panda3d"),
    "position_method": ("linear32f", "depth32f", "depth24"),
    "light_method": ("volumes", "fullscreen", "loop"),
    "supersample": (1, 2),
}
LIGHTING = {
    "specular_model": ("phong", "blinn_phong"),
    "range_falloff": ("karis", "gltf"),
    "clamp_light": (False, True),
    "shadow_taps": (1, 4, 16),
    "position_method": ("linear32f", "depth24"),
}
SHINY = {"specular": (1, 1, 1), "emission": (1, 1, 1), "ambient": (1, 0, 0)}


@cache
def all_legal():
    return {kind.name: as_products(kind().legal_variants()) for kind in PASSES}


@cache
def lit_by_all(make, name):
    """A surface of the material called `name` under every kind of light, and a planner for it."""
    texture = Texture(np.full((2, 2, 4), 255, dtype=np.uint8))
    material = {
        "plain": Material("plain"),
        "leaf": Material("leaf", texture=texture, alpha_mode="mask", double_sided=True),
        "bark": Material("bark", texture=texture),
        "tile": Material("tile", metallic=0.5, occlusion_texture=texture),
    }[name]
    near = Material("n", **({} if name == "tile" else SHINY))  # more targets than a pass has
    scene = make()
    scene.root.find("wall").set_material(material)
    scene.root.attach_new_node(PointLights("l", [(0, 8, 0)], (1, 1, 1), 5.0))
    for light in (PointLight("p"), Spotlight("t"), DirectionalLight("d")):
        light.set_shadow_caster(True, 16)
        scene.root.attach_new_node(light).set_pos(0, 5, 0)
    path = scene.root.attach_new_node(geom_node("near", wall(0.5), near))
    path.set_pos(0, 7, 0)
    path.set_color_scale(0.5, 1.0, 2.0, 1.0)
    scene.root.attach_new_node(AmbientLight("a", (1, 1, 1)))
    scene.root.attach_new_node(Sprites("s", [(0, 8, 0)]))
    scene.background = VerticalGradient((0, 0, 0), (0, 0, 1))
    return scene, new_planner()


@pytest.mark.parametrize(("names", "outputs"), [(PLACES, OUTPUT_SETS), (LIGHTING, [("color", "light")])])
def test_every_variant_of_every_plan_is_a_legal_one(names, outputs):
    """Every choice with every other; the materials, which change the variants of surfaces alone, by lot."""
    legal, seen = all_legal(), set()
    lot = Random(0)
    for make, driver, wanted, *values in product(SCENES, DRIVERS, outputs, *names.values()):
        chosen = dict(zip(names, values, strict=True))
        look, method = chosen.get("look", "correct"), chosen.get("light_method")
        if (look, method) == ("classic", "loop") or set(wanted) & {*MISSING.get(look, ())}:
            continue  # there is no such frame
        if look == "flat" and chosen["position_method"] != "linear32f":
            continue  # nothing of it depends on positions
        if chosen.get("supersample") == 2 and any(OUTPUTS[name].sampled for name in wanted):
            continue
        scene, planner = lit_by_all(make, lot.choice(MATERIALS))
        plan = planner.plan(scene, Settings(**chosen), (8, 6), wanted, 0.0, driver)
        for step in plan.passes:
            sets = [lights for lights in plan.lights if PASS_OF_KIND[lights.kind] == step.name]
            for variant in [variant_for(step.variant, lights) for lights in sets] or [step.variant]:
                assert variant in legal[step.name], (step.name, variant)
                seen.add(variant)
        for batch in plan.batches:
            (step,) = (step for step in plan.passes if step.name == "geometry")
            variant = replace(step.variant, **asdict(batch.surface))
            assert variant in legal["geometry"], variant
            seen.add(variant)
    assert len(seen) > 200
