"""Convert lights to pyrender's and back: their units, attenuation and cones.

The radiance of a matt surface of base colour c, at the distance d and the angle t to its normal, is

    ours      c cos t * color * fade(d)                 fade: see `firefly_sample.scene.light`
    pyrender  c cos t * color * intensity / (pi d^2)    as in glTF, whose matt surfaces reflect c/pi

(pyrender's surfaces also have a faint highlight, which makes this a little smaller). Neither divides by d^2
for a directional light. So for a light with the attenuation (0, 0, q)

    intensity = pi * max(color) / q,    color = color / max(color)

is exact, and so is intensity = pi * max(color) for a directional light; ambient light is c * ambient in both.
The reverse is color = color * intensity / pi with the attenuation (0, 0, 1). A max distance becomes a range,
with the falloff that glTF recommends for it (`Settings.range_falloff`); pyrender ignores ranges.

pyrender has no other attenuation. A light with more terms than q gets the intensity that is right far away;
one without q, the intensity that is right at a distance of one unit. A light that fades by (1 - d/R)^2 gets
the one that is right at R/2, where d^2 (1 - d/R)^2 is largest, so that pyrender's light is nowhere dimmer.
A warning reports each of these.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LightError
from firefly_sample.losses import Losses
from firefly_sample.scene.light import Attenuation, FadingLight
from firefly_sample.scene.lights import DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.transforms import look_at_quat, rows_from_quat

Float64 = NDArray[np.float64]

_NO_SHADOWS = "pyrender turns shadows on by RenderFlags and not by light, so that shadow casters are left out"
_NO_SPECULAR = "specular colours of lights, which pyrender lacks, are left out"
_SOFT_EDGE = "spotlights fade between their two angles by t^2 in pyrender and by t^2 (3 - 2 t) here"
_INVERSE_SQUARE = Attenuation(0.0, 0.0, 1.0)
_WIDEST = 90.0
"""Degrees: the widest half-angle of a pyrender spotlight."""


def point_lights_to_pyrender(node: PointLights, time: float, losses: Losses) -> list[tuple[Any, Float64]]:
    """Return each light of a node at `time` (seconds) as a pyrender PointLight and a matrix.

    The matrix, shape (4, 4), goes from the light's space to the node's, in our axes, for row vectors.
    """
    import pyrender

    arrays = node.evaluate(time)
    if node.is_shadow_caster():
        losses.add(_NO_SHADOWS, node.name)
    if node.specular_colors_of(arrays) is not arrays.colors:
        losses.add(_NO_SPECULAR, node.name)
    lights = []
    ends = arrays.radii.tolist()
    for index, (position, color, end) in enumerate(zip(arrays.positions, arrays.colors, ends, strict=True)):
        matrix = np.eye(4)
        matrix[3, :3] = position
        strength = _fading_strength(node, color, end, losses)
        lights.append((pyrender.PointLight(name=f"{node.name}[{index}]", **strength), matrix))
    return lights


def light_to_pyrender(
    node: FadingLight | DirectionalLight, net: Float64, losses: Losses
) -> tuple[Any, Float64 | None]:
    """Return a node of one light as a pyrender light and a matrix; `net` goes from node space to world space.

    The matrix is as in `point_lights_to_pyrender`; None is the identity. A light with a direction of its own
    needs one, and so does a spotlight below a scale, by which pyrender would multiply the cosine that it
    compares with the cone's.
    """
    import pyrender

    if node.is_shadow_caster():
        losses.add(_NO_SHADOWS, node.name)
    if node.has_specular_color():
        losses.add(_NO_SPECULAR, node.name)
    if isinstance(node, DirectionalLight):
        x, y, z = node.get_direction().tolist()
        turn = None
        if (x, y, z) != (0.0, 1.0, 0.0):
            turn = np.eye(4)
            turn[:3, :3] = rows_from_quat(look_at_quat((x, y, z), (0.0, 0.0, 1.0)))
        return pyrender.DirectionalLight(name=node.name, **_strength(node.get_color(), math.pi)), turn

    strength = _fading_strength(node, node.get_color(), node.get_max_distance(), losses)
    if not isinstance(node, Spotlight):
        return pyrender.PointLight(name=node.name, **strength), None

    inner, outer, exponent = node.get_cone()
    if exponent != 0.0:
        losses.add("pyrender's spotlights have no exponent and are even up to their edge", node.name)
    if inner != outer:
        losses.add(_SOFT_EDGE, node.name)
    if outer > _WIDEST:
        losses.add("pyrender's spotlights are narrowed to 90 degrees on each side", node.name)
    length = float(np.linalg.norm(net[1, :3]))
    if not (math.isfinite(length) and length > 0.0):
        raise LightError(f"light {node.name!r}: its net transform leaves it no direction to shine in")
    unscaled = None if abs(length - 1.0) < 1e-9 else np.diag([1.0 / length] * 3 + [1.0])
    light = pyrender.SpotLight(
        innerConeAngle=math.radians(min(inner, _WIDEST)),
        outerConeAngle=math.radians(min(outer, _WIDEST)),
        name=node.name,
        **strength,
    )
    return light, unscaled


def light_from_pyrender(
    light: Any, name: str, losses: Losses, alike: bool = False
) -> PointLight | Spotlight | DirectionalLight:
    """Return a pyrender light as a node of one light.

    `alike` is for the look "pyrender", in which cones fade as they do there and ranges end no light.
    """
    import pyrender

    color = np.asarray(light.color, dtype=np.float64) * (light.intensity / math.pi)
    if isinstance(light, pyrender.DirectionalLight):
        return DirectionalLight(name, color)
    made: PointLight | Spotlight
    if isinstance(light, pyrender.SpotLight):
        made = Spotlight(name, color)
        made.set_cone(math.degrees(light.innerConeAngle), math.degrees(light.outerConeAngle))
        if light.innerConeAngle != light.outerConeAngle and not alike:
            losses.add(_SOFT_EDGE, name)
    else:
        made = PointLight(name, color)
    made.set_attenuation(_INVERSE_SQUARE)
    if light.range is not None and not alike:
        losses.add("light ends at its range here, but shines beyond it in pyrender", name)
        made.set_max_distance(light.range)
    return made


def _fading_strength(
    node: FadingLight | PointLights, color: Float64, end: float, losses: Losses
) -> dict[str, Any]:
    """Return pyrender's colour, intensity and range of a light that ends at the distance `end`."""
    factor = _inverse_square(node.name, node.get_attenuation(), end, losses)
    return {"range": end if 0.0 < end < math.inf else None, **_strength(color, factor)}


def _inverse_square(name: str, attenuation: Attenuation | None, end: float, losses: Losses) -> float:
    """Return the factor from a light's colour to its radiant intensity in pyrender."""
    if end == 0.0:
        return 0.0
    if attenuation is None:
        losses.add("light that fades over a radius R fades by 1/d^2 in pyrender, equal at R/2", name)
        return math.pi * (end / 4.0) ** 2
    if end < math.inf:
        losses.add("pyrender keeps how far lights reach as their range, but draws them beyond it", name)
    constant, linear, quadratic = attenuation
    if quadratic == 0.0:
        losses.add(
            "light without a quadratic attenuation fades by 1/d^2 in pyrender, equal at a distance of 1", name
        )
        return math.pi / (constant + linear)
    if constant or linear:
        losses.add("light fades by 1/d^2 alone in pyrender, equal far away and brighter near by", name)
    return math.pi / quadratic


def _strength(color: Float64, factor: float) -> dict[str, Any]:
    """Return `color` times `factor` as pyrender's colour, with a largest channel of 1, and intensity."""
    largest = float(color.max())
    return {"color": color / largest if largest > 0.0 else np.ones(3), "intensity": largest * factor}
