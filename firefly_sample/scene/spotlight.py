"""Spotlights: a cone of light, cut hard as Panda3D's, or with a smooth edge."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import ArrayLike

from firefly_sample.errors import LightError
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.light import FadingLight
from firefly_sample.settings import to_number

SMALLEST_CONE = 0.01
"""Degrees of the narrowest cone's half-angle: below, float32 cannot tell inside from outside."""

DEFAULT_FOV = 30.0
DEFAULT_EXPONENT = 50.0


class Cone(NamedTuple):
    """How a spotlight fades with the angle from its axis.

    Attributes
    ----------
    inner, outer : float
        Half-angles in degrees: full strength within `inner`, none from `outer` on, a smooth step of
        1 - cos(angle) between. Equal ones cut hard.
    exponent : float
        The strength is also multiplied by cos(angle)^exponent.
    """

    inner: float
    outer: float
    exponent: float


class Spotlight(FadingLight):
    """A light at its node's origin that shines along +Y into a cone.

    As in Panda3D, a lens says how wide the cone is, which ends hard at half of the lens's horizontal field of
    view (30 degrees when nothing says otherwise), and an exponent (50) how much it fades off its axis.
    `set_cone` gives it a smooth edge between two angles instead. Diffuse light and highlights fade alike.

    Parameters
    ----------
    name, color, radius : see `FadingLight`
    """

    def __init__(self, name: str, color: ArrayLike = (1.0, 1.0, 1.0), radius: float | None = None) -> None:
        super().__init__(name, color, radius)
        self._lens = PerspectiveLens(fov=DEFAULT_FOV)
        self._exponent = DEFAULT_EXPONENT
        self._edge: tuple[float, float] | None = None

    def set_lens(self, lens: PerspectiveLens) -> None:
        """Let the cone be as wide as a lens sees, with a hard edge; changes of the lens are followed.

        Raises
        ------
        LightError
            If it is not a `PerspectiveLens`.
        """
        if not isinstance(lens, PerspectiveLens):
            raise LightError(f"light {self.name!r}: a spotlight's lens is a PerspectiveLens, got {lens!r}")
        self._lens, self._edge = lens, None
        self.mark_changed()

    def get_lens(self) -> PerspectiveLens:
        """The lens whose horizontal field of view is the cone's full angle, unless `set_cone` gave others."""
        return self._lens

    def set_exponent(self, exponent: float) -> None:
        """Set how fast the light of a lens's cone fades off its axis: by cos(angle)^exponent; 0 is evenly.

        Raises
        ------
        LightError
            If it is not a number from 0 to 1e6.
        """
        given = to_number(exponent)
        if not 0.0 <= given <= 1e6:
            raise LightError(f"light {self.name!r}: exponent must be a number of 0 to 1e6, got {exponent!r}")
        self._exponent = given
        self.mark_changed()

    def get_exponent(self) -> float:
        """The exponent."""
        return self._exponent

    def set_cone(self, inner: float, outer: float) -> None:
        """Let the light be even up to one angle from its axis, and fade smoothly to nothing at another.

        Lens and exponent do not matter then, until `set_lens` is called.

        Parameters
        ----------
        inner, outer : float
            Half-angles in degrees, 0 <= inner <= outer <= 180, outer at least 0.01. The light-volume
            slides' are 20 and 30.

        Raises
        ------
        LightError
            If they are not such angles.
        """
        angles = to_number(inner), to_number(outer)
        if not (0.0 <= angles[0] <= angles[1] <= 180.0 and angles[1] >= SMALLEST_CONE):
            raise LightError(
                f"light {self.name!r}: a cone's half-angles must be 0 <= inner <= outer <= 180 degrees with "
                f"outer at least {SMALLEST_CONE:g}, got {inner!r} and {outer!r}"
            )
        self._edge = angles
        self.mark_changed()

    def get_cone(self) -> Cone:
        """The cone that holds: `set_cone`'s, or the lens's with the exponent.

        Raises
        ------
        LightError
            If the lens sees less than 0.02 degrees.
        """
        if self._edge is not None:
            return Cone(*self._edge, 0.0)
        half = 0.5 * self._lens.get_hfov()
        # half of twice the smallest angle may come out an ulp below it
        if half < SMALLEST_CONE * (1.0 - 1e-9):
            raise LightError(
                f"light {self.name!r}: its lens sees {2.0 * half:g} degrees: a spotlight needs "
                f"{2.0 * SMALLEST_CONE:g} or more"
            )
        return Cone(half, half, self._exponent)

    def make_copy(self) -> Spotlight:
        """A new light with the same colours, cone, fading, shadows, transform and (shared) lens."""
        copy = Spotlight(self.name)
        self._copy_fade_to(copy)
        copy._lens, copy._exponent, copy._edge = self._lens, self._exponent, self._edge
        return copy
