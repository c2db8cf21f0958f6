"""Single numbers of a `firefly_sample.scene.nodepath.NodePath`'s transform.

``set_x([other,] value)`` keeps y and z, and so on.
"""

from __future__ import annotations

from typing import Any

from firefly_sample.scene.path_transforms import PathTransforms


class PathNumbers(PathTransforms):
    """The methods of a `NodePath` that read and set one number of its transform."""

    __slots__ = ()

    def get_x(self, other: PathTransforms | None = None) -> float:
        """Return the position along x."""
        return self.get_transform(other).get_pos()[0]

    def set_x(self, *arguments: Any) -> None:
        """Set the position along x."""
        self._set_one("pos", 0, "set_x", arguments)

    def get_y(self, other: PathTransforms | None = None) -> float:
        """Return the position along y."""
        return self.get_transform(other).get_pos()[1]

    def set_y(self, *arguments: Any) -> None:
        """Set the position along y."""
        self._set_one("pos", 1, "set_y", arguments)

    def get_z(self, other: PathTransforms | None = None) -> float:
        """Return the position along z."""
        return self.get_transform(other).get_pos()[2]

    def set_z(self, *arguments: Any) -> None:
        """Set the position along z."""
        self._set_one("pos", 2, "set_z", arguments)

    def get_h(self, other: PathTransforms | None = None) -> float:
        """Return the heading in degrees."""
        return self.get_transform(other).get_hpr()[0]

    def set_h(self, *arguments: Any) -> None:
        """Set the heading in degrees."""
        self._set_one("hpr", 0, "set_h", arguments)

    def get_p(self, other: PathTransforms | None = None) -> float:
        """Return the pitch in degrees."""
        return self.get_transform(other).get_hpr()[1]

    def set_p(self, *arguments: Any) -> None:
        """Set the pitch in degrees."""
        self._set_one("hpr", 1, "set_p", arguments)

    def get_r(self, other: PathTransforms | None = None) -> float:
        """Return the roll in degrees."""
        return self.get_transform(other).get_hpr()[2]

    def set_r(self, *arguments: Any) -> None:
        """Set the roll in degrees."""
        self._set_one("hpr", 2, "set_r", arguments)

    def get_sx(self, other: PathTransforms | None = None) -> float:
        """Return the scale along x."""
        return self.get_transform(other).get_scale()[0]

    def set_sx(self, *arguments: Any) -> None:
        """Set the scale along x."""
        self._set_one("scale", 0, "set_sx", arguments)

    def get_sy(self, other: PathTransforms | None = None) -> float:
        """Return the scale along y."""
        return self.get_transform(other).get_scale()[1]

    def set_sy(self, *arguments: Any) -> None:
        """Set the scale along y."""
        self._set_one("scale", 1, "set_sy", arguments)

    def get_sz(self, other: PathTransforms | None = None) -> float:
        """Return the scale along z."""
        return self.get_transform(other).get_scale()[2]

    def set_sz(self, *arguments: Any) -> None:
        """Set the scale along z."""
        self._set_one("scale", 2, "set_sz", arguments)

    def get_shxy(self, other: PathTransforms | None = None) -> float:
        """Return the shear of x by y."""
        return self.get_transform(other).get_shear()[0]

    def set_shxy(self, *arguments: Any) -> None:
        """Set the shear of x by y."""
        self._set_one("shear", 0, "set_shxy", arguments)

    def get_shxz(self, other: PathTransforms | None = None) -> float:
        """Return the shear of x by z."""
        return self.get_transform(other).get_shear()[1]

    def set_shxz(self, *arguments: Any) -> None:
        """Set the shear of x by z."""
        self._set_one("shear", 1, "set_shxz", arguments)

    def get_shyz(self, other: PathTransforms | None = None) -> float:
        """Return the shear of y by z."""
        return self.get_transform(other).get_shear()[2]

    def set_shyz(self, *arguments: Any) -> None:
        """Set the shear of y by z."""
        self._set_one("shear", 2, "set_shyz", arguments)

    # --- Panda3D's names for moves whose path collisions consider; nothing collides here ---

    def set_fluid_pos(self, *arguments: Any) -> None:
        """Set the position, as `set_pos`."""
        self.set_pos(*arguments)

    def set_fluid_x(self, *arguments: Any) -> None:
        """Set the position along x, as `set_x`."""
        self.set_x(*arguments)

    def set_fluid_y(self, *arguments: Any) -> None:
        """Set the position along y, as `set_y`."""
        self.set_y(*arguments)

    def set_fluid_z(self, *arguments: Any) -> None:
        """Set the position along z, as `set_z`."""
        self.set_z(*arguments)

    # --- Private ---

    def _set_one(self, name: str, index: int, what: str, arguments: tuple[Any, ...]) -> None:
        other, rest = self._split(arguments)
        (value,) = self._numbers(what, 1, rest)
        numbers = list(getattr(self.get_transform(other), f"get_{name}")())
        numbers[index] = value
        self._set_part(name, other, self._vec3(what, (numbers,)))
