"""Skeletons of trees: curves with radii that carry further curves."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from builder.randomness import Random
from builder.surface import perpendicular, rotate, unit

GOLDEN_ANGLE = math.radians(137.508)


@dataclass
class Branch:
    """A curve (n, 3) with radii (n,), and the branches that leave it."""

    path: np.ndarray
    radii: np.ndarray
    level: int
    children: list = field(default_factory=list)

    def at(self, t):
        """Point, direction and radius at the fraction `t` of the curve."""
        n = len(self.path) - 1
        k = min(int(t * n), n - 1)
        f = t * n - k
        point = self.path[k] * (1.0 - f) + self.path[k + 1] * f
        return (
            point,
            unit(self.path[k + 1] - self.path[k]),
            self.radii[k] * (1.0 - f) + self.radii[k + 1] * f,
        )

    def walk(self):
        """This branch and all that it carries."""
        yield self
        for child in self.children:
            yield from child.walk()


@dataclass(frozen=True)
class Habit:
    """How the branches of one level grow.

    Attributes
    ----------
    count : int
        Branches on each parent.
    span : (float, float)
        The part of the parent on which they sit, as fractions of its length.
    angle : (float, float)
        Angle to the parent's direction at the low and the high end of that span, in degrees.
    length : (float, float)
        Length as a fraction of the parent's, at the low and the high end.
    thickness : float
        Radius at the start as a fraction of the parent's there.
    wobble : float
        Random bending, in radians a segment.
    rise : float
        Bending towards the sky (below 0: towards the ground), in radians over the whole curve.
    segments : int
        Straight pieces of the curve.
    flat : float
        0: branches stand all around their parent; 1: they lie in the plane of its two sides.
    """

    count: int
    span: tuple = (0.3, 1.0)
    angle: tuple = (60.0, 40.0)
    length: tuple = (0.5, 0.3)
    thickness: float = 0.6
    wobble: float = 0.12
    rise: float = 0.3
    segments: int = 5
    flat: float = 0.0


def curve(random, start, direction, length, segments, wobble, rise):
    """Points of a curve that wanders and bends towards the sky."""
    step = length / segments
    direction = unit(np.asarray(direction, float))
    points = [np.asarray(start, float)]
    for _ in range(segments):
        points.append(points[-1] + direction * step)
        direction = unit(direction + wobble * random.direction())
        sky = np.array([0.0, 0.0, 1.0 if rise > 0 else -1.0])
        axis = np.cross(direction, sky)
        size = np.linalg.norm(axis)
        if size > 1e-3:
            reach = math.atan2(size, float(np.dot(direction, sky)))
            direction = rotate(direction, axis / size, min(abs(rise) / segments, reach))
    return np.array(points)


def taper(radius, tip, segments, power=1.0):
    """Radii from `radius` down to `tip`."""
    t = np.linspace(0.0, 1.0, segments + 1)
    return tip + (radius - tip) * (1.0 - t) ** power


def trunk(random, height, radius, lean=0.06, wobble=0.05, segments=10, tip=0.15, power=0.9):
    """A trunk that starts below the ground and wanders a little, mostly low down and high up."""
    direction = np.array([random.around(0.0, lean), random.around(0.0, lean), 1.0])
    path = curve(random, (0.0, 0.0, 0.0), direction, height, segments, wobble, 0.35)
    return Branch(path, taper(radius, tip, segments, power), 0)


def grow(random, parent, habits, fullness=None):
    """Give `parent` children by the first of `habits`, those children theirs by the next, and so on.

    `fullness(t)` scales lengths along the parent of the first habit: the outline of the crown.
    """
    if not habits:
        return
    habit = habits[0]
    angle = random.between(0.0, 2.0 * math.pi)
    reach = np.linalg.norm(np.diff(parent.path, axis=0), axis=1).sum()
    for k in range(habit.count):
        share = (k + random.between(0.15, 0.85)) / habit.count
        t = habit.span[0] + (habit.span[1] - habit.span[0]) * share
        point, direction, radius = parent.at(min(t, 0.999))
        angle += GOLDEN_ANGLE + random.around(0.0, 0.5)
        side = perpendicular(direction)
        if habit.flat:
            # Alternate left and right of the parent, with a little spread out of the plane.
            turn = (math.pi / 2.0 if k % 2 else -math.pi / 2.0) + random.around(0.0, 1.2 * (1.0 - habit.flat))
        else:
            turn = angle
        outward = rotate(side, direction, turn)
        tilt = math.radians(habit.angle[0] + (habit.angle[1] - habit.angle[0]) * share)
        tilt += random.around(0.0, 0.18)
        heading = direction * math.cos(tilt) + outward * math.sin(tilt)
        length = reach * (habit.length[0] + (habit.length[1] - habit.length[0]) * share)
        length *= random.between(0.8, 1.15) * (1.0 if fullness is None else fullness(share))
        path = curve(random, point, heading, length, habit.segments, habit.wobble, habit.rise)
        thick = max(radius * habit.thickness, 0.06)
        child = Branch(path, taper(thick, thick * 0.22, habit.segments), parent.level + 1)
        parent.children.append(child)
        grow(random, child, habits[1:])


def streams(seed, n):
    """`n` independent streams, so that a change in one part of a tree leaves the others alone."""
    return [Random(seed * 1000 + k) for k in range(n)]
