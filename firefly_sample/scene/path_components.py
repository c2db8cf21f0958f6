"""The part of NodePath for single numbers: x, y, z, heading, pitch, roll, and each scale and shear."""

from __future__ import annotations

from typing import Any

from firefly_sample.scene.path_transform import PathTransform


class PathComponents(PathTransform):
    """Single components of a NodePath's transform, in the parent's space or in that of `other`.

    A setter is ``set_x([other,] value)``. It reads the whole vector, changes one number and writes it
    back, so the other two stay as they are in the same space.
    """

    __slots__ = ()

    def get_x(self, other: PathTransform | None = None) -> float:
        """The position along x."""
        return self.get_transform(other).get_pos()[0]

    def set_x(self, *arguments: Any) -> None:
        """Set the position along x."""
        self._set_one("pos", 0, "set_x", arguments)

    def get_y(self, other: PathTransform | None = None) -> float:
        """The position along y."""
        return self.get_transform(other).get_pos()[1]

    def set_y(self, *arguments: Any) -> None:
        """Set the position along y."""
        self._set_one("pos", 1, "set_y", arguments)

    def get_z(self, other: PathTransform | None = None) -> float:
        """The position along z."""
        return self.get_transform(other).get_pos()[2]

    def set_z(self, *arguments: Any) -> None:
        """Set the position along z."""
        self._set_one("pos", 2, "set_z", arguments)

    def get_h(self, other: PathTransform | None = None) -> float:
        """The heading in degrees."""
        return self.get_transform(other).get_hpr()[0]

    def set_h(self, *arguments: Any) -> None:
        """Set the heading in degrees."""
        self._set_one("hpr", 0, "set_h", arguments)

    def get_p(self, other: PathTransform | None = None) -> float:
        """The pitch in degrees."""
        return self.get_transform(other).get_hpr()[1]

    def set_p(self, *arguments: Any) -> None:
        """Set the pitch in degrees."""
        self._set_one("hpr", 1, "set_p", arguments)

    def get_r(self, other: PathTransform | None = None) -> float:
        """The roll in degrees."""
        return self.get_transform(other).get_hpr()[2]

    def set_r(self, *arguments: Any) -> None:
        """Set the roll in degrees."""
        self._set_one("hpr", 2, "set_r", arguments)

    def get_sx(self, other: PathTransform | None = None) -> float:
        """The scale along x."""
        return self.get_transform(other).get_scale()[0]

    def set_sx(self, *arguments: Any) -> None:
        """Set the scale along x."""
        self._set_one("scale", 0, "set_sx", arguments)

    def get_sy(self, other: PathTransform | None = None) -> float:
        """The scale along y."""
        return self.get_transform(other).get_scale()[1]

    def set_sy(self, *arguments: Any) -> None:
        """Set the scale along y."""
        self._set_one("scale", 1, "set_sy", arguments)

    def get_sz(self, other: PathTransform | None = None) -> float:
        """The scale along z."""
        return self.get_transform(other).get_scale()[2]

    def set_sz(self, *arguments: Any) -> None:
        """Set the scale along z."""
        self._set_one("scale", 2, "set_sz", arguments)

    def get_shxy(self, other: PathTransform | None = None) -> float:
        """The shear of x by y."""
        return self.get_transform(other).get_shear()[0]

    def set_shxy(self, *arguments: Any) -> None:
        """Set the shear of x by y."""
        self._set_one("shear", 0, "set_shxy", arguments)

    def get_shxz(self, other: PathTransform | None = None) -> float:
        """The shear of x by z."""
        return self.get_transform(other).get_shear()[1]

    def set_shxz(self, *arguments: Any) -> None:
        """Set the shear of x by z."""
        self._set_one("shear", 1, "set_shxz", arguments)

    def get_shyz(self, other: PathTransform | None = None) -> float:
        """The shear of y by z."""
        return self.get_transform(other).get_shear()[2]

    def set_shyz(self, *arguments: Any) -> None:
        """Set the shear of y by z."""
        self._set_one("shear", 2, "set_shyz", arguments)

    def _set_one(self, vector: str, index: int, what: str, arguments: tuple[Any, ...]) -> None:
        other, rest = self._split(arguments)
        (value,) = self._numbers(what, 1, rest)
        numbers = list(getattr(self.get_transform(other), f"get_{vector}")())
        numbers[index] = value
        setter = getattr(self, f"set_{vector}")
        setter(*(() if other is None else (other,)), numbers)
