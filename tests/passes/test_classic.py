"""The original's look against a NumPy model of what the original computes, faults included."""

import numpy as np

from firefly_sample.scene.material import Material, Texture
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.scenes import ball_scene, wall_scene


def model(plan, surface):
    """Stored textures, stored normals, light added in display space into 8 bits, light after light."""
    position, normal, albedo = surface.position(), surface.normal(), surface.albedo()
    total = np.zeros_like(albedo)
    for lights in plan.lights:
        for center, color, radius in zip(lights.positions, lights.colors, lights.ends, strict=True):
            offset = center - position
            distance = np.linalg.norm(offset, axis=-1)
            with np.errstate(invalid="ignore"):
                factor = np.maximum((normal * offset).sum(-1) / distance, 0) * (1 - distance / radius) ** 2
                factor = np.where(distance < radius, factor, 0)
            total += np.round(albedo * factor[..., None] * color * 255) / 255
    return np.minimum(total, 1.0)


def test_classic_is_the_original(render):
    scene = ball_scene(60)
    with make_renderer((160, 120), Settings(look="classic")) as renderer:
        plan = renderer.plan(scene, 0.0, ("color", "albedo", "normal", "position"))
        frame = renderer.draw(plan)
        surface = renderer.surface(plan)
        covered = np.isfinite(surface.position()).all(axis=-1)
        expected = model(plan, surface)
    difference = np.abs(frame.color[covered] / 255.0 - expected[covered]) * 255
    # one code for each light whose share lies on a rounding edge
    assert difference.max() <= 2
    assert difference.mean() <= 0.02
    assert plan.target("radiance").format == "rgba8"


def test_classic_uses_textures_as_stored(render):
    pixels = np.full((2, 2, 4), 128, dtype=np.uint8)
    material = Material("grey", texture=Texture(pixels))
    scene = wall_scene(material=material)
    assert (
        np.abs(render(scene, Settings(look="classic"), (8, 6), ("albedo",)).albedo - 128 / 255).max() <= 1e-6
    )


def test_classic_differs_from_correct_where_a_fault_shows(render):
    """Undecoded normals: a surface that faces away from a light can be lit."""
    scene = ball_scene(60)
    correct = render(scene, Settings(tone="none"), (160, 120)).color.astype(int)
    classic = render(scene, Settings(look="classic"), (160, 120)).color.astype(int)
    assert np.abs(correct - classic).max() > 40
