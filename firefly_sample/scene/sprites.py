"""Soft additive dots that face the camera: the glow of the insects themselves, haze, sparks."""

from __future__ import annotations

from firefly_sample.scene.points import PointsNode


class Sprites(PointsNode):
    """Any number of round dots, added to the picture, hidden by what stands before them.

    Their radiance is color * (1 - (r/radius)^2)^2 at the distance r from the centre; a dot smaller than
    a pixel is drawn a pixel wide and as much fainter, so that far dots neither vanish nor flicker.
    Parameters and errors are those of `PointsNode`.
    """

    KIND = "sprites"

    def make_copy(self) -> Sprites:
        """A new node with the same dots, transform and attributes, without children."""
        copy = Sprites(self.name)
        self._copy_points_to(copy)
        return copy
