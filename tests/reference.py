"""A rendered frame held against float64 shading of the same G-buffer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from firefly_sample.lab.reference import panda3d
from firefly_sample.lab.reference.shade import each_light, nearest_light, shade_apart
from firefly_sample.lab.reference.shadow import cube_faces, shadow
from tests.conftest import borrow_renderer, make_renderer

BOUNDS = {"linear32f": 4e-6, "depth32f": 5e-5, "depth24": 1.2e-4}
"""Largest difference over the 99.9th percentile of the picture, by position method."""

TERMINATOR = 1e-5
"""Cosine below which a surface may be lit or not: there a highlight begins with a jump."""


LONGEST = 6.0
"""Of a reach that counts for how near is too near: the scenes here are a dozen units large."""


@dataclass(eq=False)
class Compared:
    """A frame and what float64 makes of its G-buffer.

    `chosen` are the pixels that are compared: covered, no light nearer than 0.01 of its reach, and, where
    there are highlights or hard cones, not on an edge where the picture jumps.
    """

    plan: object
    frame: object
    gbuffer: object
    expected: np.ndarray
    expected_light: np.ndarray
    covered: np.ndarray
    chosen: np.ndarray

    def error(self, name="radiance", near=None):
        """Largest difference over the 99.9th percentile."""
        image = self.frame[name].astype(np.float64)
        assert np.isfinite(image).all()
        expected = self.expected if name == "radiance" else self.expected_light
        chosen = self.chosen if near is None else near & self.covered
        difference = np.abs(image[chosen] - expected[chosen]).max(initial=0.0)
        return difference / np.percentile(expected[self.covered], 99.9)


def compare(scene, settings, size=(112, 84), time=0.0, capabilities=None, shadows=False):
    """Render `scene`, and shade its G-buffer in float64; with `shadows`, from the atlas that was drawn."""
    lender = borrow_renderer if capabilities is None else make_renderer
    with lender(size, settings) as renderer:
        if capabilities is not None:
            renderer._device.capabilities = capabilities
        outputs = (
            "radiance",
            "light",
            "position",
            "normal",
            "albedo",
            "specular",
            "emission",
            "shadow_atlas",
        )
        plan = renderer.plan(scene, time, outputs)
        frame = renderer.draw(plan)
        surface = renderer.surface(plan)
        gbuffer = surface.gbuffer()
        ambient_albedo, tint = surface.ambient_albedo(), surface.tint()
        atlas = surface.image("shadow_atlas")[::-1].astype(np.float64)
    lookup = _lookup(plan, gbuffer, atlas) if shadows else None
    matt, gloss, light = shade_apart(gbuffer, plan.lights, plan.settings, lookup)
    covered = np.isfinite(gbuffer.position).all(axis=-1)
    emission = frame["emission"].astype(np.float64)
    if plan.settings.look == "panda3d":
        radiance = panda3d.shown(matt + ambient_albedo * plan.ambient + emission, tint, gloss)
    else:
        radiance = (matt + gloss + ambient_albedo * plan.ambient) * tint + emission
    light = np.where(covered[..., None], light + plan.ambient, 0.0)
    chosen = covered & ~(nearest_light(gbuffer.position, plan.lights, LONGEST) < 0.01)
    return Compared(plan, frame, gbuffer, radiance, light, covered, chosen & ~_jumps(plan, gbuffer))


def _jumps(plan, gbuffer):
    """Where a highlight begins at the terminator, or a hard cone ends: float32 may be on the other side."""
    shiny = gbuffer.specular.any()
    place, unit = gbuffer.position.reshape(-1, 3), gbuffer.normal.reshape(-1, 3)
    jumps = np.zeros(len(place), dtype=bool)
    for one in each_light(lights for lights in plan.lights if shiny or lights.kind == "spot"):
        to_light, _ = one.directions(place)
        reached = one.in_reach(place)
        if shiny:
            jumps |= reached & (np.abs(np.einsum("ij,ij->i", unit, to_light)) < TERMINATOR)
        if one.lights.kind == "spot":
            inner, outer, _ = one.lights.cones[one.row]
            if inner == outer < 2.0 - 1e-9:
                angle = np.arctan2(
                    np.linalg.norm(np.cross(to_light, one.lights.directions[one.row]), axis=1),
                    -(to_light @ one.lights.directions[one.row]),
                )
                edge = 2 * np.arcsin(np.sqrt(outer / 2))
                jumps |= reached & (np.abs(angle - edge) < 1e-6 + 1e-5 * edge)
    return jumps.reshape(gbuffer.position.shape[:-1])


def _lookup(plan, gbuffer, atlas):
    """The lit share of pixels by the float64 twin of the shader's lookup."""
    to_world = plan.view.view_to_world
    position, normal = gbuffer.position.reshape(-1, 3), gbuffer.normal.reshape(-1, 3)

    def lit(one, pixels, n_dot_l):
        place = position[pixels] @ to_world[:3, :3] + to_world[3, :3]
        turned = normal[pixels] @ to_world[:3, :3]
        first, count = one.lights.casters[one.row], one.lights.maps[one.row]
        faces = np.zeros(len(pixels), dtype=int)
        if count > 1:
            center = one.lights.positions[one.row] @ to_world[:3, :3] + to_world[3, :3]
            faces = cube_faces(place - center)
        share = np.ones(len(pixels))
        for face in range(count):
            here = faces == face
            share[here] = shadow(
                atlas,
                plan.shadows.maps[first + face],
                plan.view.reverse,
                plan.settings.shadow_taps,
                place[here],
                turned[here],
                n_dot_l[here],
                position[pixels][here, 1],
            )
        return share

    return lit
