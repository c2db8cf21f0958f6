"""The door's scenes with the flags that they are drawn with, and the limits of their comparison.

Both draw with one sample in a pixel, which makes every pixel comparable, also those on edges.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pyrender
from pyrender import RenderFlags

from tests.interop import door_scenes as scenes


@dataclass(frozen=True)
class Case:
    """A scene, how it is drawn, and how far its picture may be from pyrender's.

    Attributes
    ----------
    build : callable
        Makes the scene.
    flags : int
    point_size : float
    largest : int
        The largest difference of a code: the door lights a point in each pixel of its square, pyrender in its
        centre alone.
    has_ties : bool
        True if edges of several triangles share pixels: pyrender shows the first one, the door the last one.
    """

    build: Callable[[], pyrender.Scene]
    flags: int = RenderFlags.NONE
    point_size: float = 1.0
    largest: int = 1
    has_ties: bool = False

    @property
    def name(self) -> str:
        flags = [name for name, value in vars(RenderFlags).items() if value and self.flags == value]
        size = [] if self.point_size == 1.0 else [f"size {self.point_size:g}"]
        return " ".join([self.build.__name__, *flags, *size])


CASES = [
    *map(
        Case,
        [
            scenes.smooth_and_flat,
            scenes.one_lamp,
            scenes.four_lamps,
            scenes.spotlights,
            scenes.twelve_lights,
            scenes.no_light,
            scenes.default_background,
            scenes.textures,
            scenes.pbr_visuals,
            scenes.samplers,
            scenes.surface_maps,
            scenes.vertex_colors,
            scenes.lines,
            scenes.instances,
            scenes.nested_nodes,
            scenes.mirrored,
            scenes.invisible,
            scenes.double_sided,
            scenes.panes,
            scenes.vertex_alpha,
            scenes.stretched,
            scenes.intrinsics,
            scenes.orthographic,
            scenes.moved_camera,
            scenes.several_primitives,
            scenes.strips_and_fans,
            scenes.no_normals,
        ],
    ),
    Case(scenes.points, largest=3),
    Case(scenes.points, point_size=4.0, largest=7),
    Case(scenes.points, RenderFlags.FLAT, point_size=4.0),
    Case(scenes.points, RenderFlags.ALL_WIREFRAME, point_size=4.0, largest=7),
    Case(scenes.lines, point_size=4.0),
    Case(scenes.wireframes, has_ties=True),
    Case(scenes.clear_background, RenderFlags.RGBA),
    Case(scenes.textures, RenderFlags.FLAT),
    Case(scenes.vertex_colors, RenderFlags.FLAT),
    Case(scenes.panes, RenderFlags.FLAT),
    Case(scenes.smooth_and_flat, RenderFlags.ALL_WIREFRAME, has_ties=True),
    Case(scenes.wireframes, RenderFlags.FLIP_WIREFRAME),
    Case(scenes.inside_out, RenderFlags.SKIP_CULL_FACES),
]
