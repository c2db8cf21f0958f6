"""The errors that this package raises on purpose, and its own class of warnings.

::

    FireflyError                      something a user can act on; str() is one line
    ├── SceneError                    the scene graph, a light, a lens or a parameter
    │   ├── NodeError                 a node: a cycle, a detached node, a singular matrix, a non-finite number
    │   ├── LightError                a light's colour, radius or arrays
    │   ├── LensError                 a lens's field of view, film, near or far
    │   ├── ParameterError            a scene parameter's name, type or range
    │   └── SceneNotFoundError        no such scene plugin
    ├── ModelError                    a model file that is missing or damaged
    ├── SettingsError                 a setting's name, value or combination
    ├── OutputError                   an output (image) that does not exist or contradicts a setting
    ├── PlanError                     a pass that reads a target which no pass has written
    ├── MissingPackageError           a package that is optional and not installed
    ├── ViewerError                   no display, or no library, to open a window with
    └── GpuError                      the driver
        ├── NoGpuError                no GL library, no device, or a software driver where a GPU was required
        └── ShaderError               a shader that does not compile; names file and line

    SoftwareDriverWarning             a UserWarning: there is no GPU; pictures are right, but drawing is slow
    NoEffectWarning                   a UserWarning: a method of Panda3D's that changes nothing here

Each error is also the built-in exception that fits (`ValueError`, `ImportError`,
`RuntimeError`), so that callers need not import this module to catch them.
"""

from __future__ import annotations

from collections.abc import Iterable


class FireflyError(Exception):
    """The root of all errors of this package; str() is one line: what, where and what to do.

    Characters that cannot be printed, which damaged files and odd names have, are written as escapes.
    """

    def __init__(self, *parts: object) -> None:
        super().__init__(*(printable(part) if isinstance(part, str) else part for part in parts))


class SceneError(FireflyError, ValueError):
    """Something in the scene description is wrong."""


class NodeError(SceneError):
    """A node of the scene graph cannot do what was asked; the message names the node."""


class LightError(SceneError):
    """A light's data is wrong; the message names the light."""


class LensError(SceneError):
    """A lens's values are wrong or contradict each other."""


class ParameterError(SceneError):
    """A scene parameter does not exist, or its value is of the wrong type or out of range."""


class SceneNotFoundError(SceneError):
    """There is no scene plugin of that name."""


class ModelError(FireflyError, ValueError):
    """A model file is missing or damaged; the message names the file."""


class SettingsError(FireflyError, ValueError):
    """A setting does not exist, may not have that value, or contradicts another one."""


class OutputError(FireflyError, ValueError):
    """An output image does not exist, or contradicts the settings."""


class PlanError(FireflyError, RuntimeError):
    """A frame plan is inconsistent; the message names the pass and the target."""


class MissingPackageError(FireflyError, ImportError):
    """An optional package is not installed; the message says how to install it."""


class ViewerError(FireflyError, RuntimeError):
    """A window cannot be opened; the message says what works without one."""


class GpuError(FireflyError, RuntimeError):
    """The driver refused something."""


class NoGpuError(GpuError):
    """There is no OpenGL driver, or not the one that was asked for."""


class ShaderError(GpuError):
    """A shader does not compile or link; the message names file and line."""


class SoftwareDriverWarning(UserWarning):
    """The driver computes on the CPU: pictures are right, but drawing is slow.

    ``warnings.filterwarnings("ignore", category=firefly_sample.SoftwareDriverWarning)`` silences it.
    """


class NoEffectWarning(UserWarning):
    """A method of Panda3D's that changes nothing here; the message says why, or what to do instead.

    ``warnings.filterwarnings("ignore", category=firefly_sample.NoEffectWarning)`` silences it.
    """


RENAMED: dict[str, tuple[str, ...]] = {
    # settings
    "position": ("position_method",),
    "normals": ("normal_format",),
    "albedo": ("albedo_format",),
    "accumulation": ("accumulation_format",),
    "lights": ("light_method", "counts"),  # the second of measure speed
    "window": ("range_falloff",),
    "specular": ("specular_model",),
    "particle_slices": ("particle_order_depths",),
    "volume_shadows": ("particle_shadows",),
    "volume_slices": ("particle_shadow_slices",),
    "volume_tile": ("particle_shadow_tile",),
    "volume_format": ("particle_shadow_format",),
    "volume_reads": ("particle_shadow_reads",),
    "volume_interpolation": ("particle_shadow_interpolation",),
    "no_volume_interpolation": ("no_particle_shadow_interpolation",),
    # a scene's own option
    "scene_lights": ("lights",),
    # outputs, classes and modules
    "volume_atlas": ("particle_shadow_atlas",),
    "VolumeShadow": ("ParticleShadow",),
    "firefly_sample.measure": ("firefly_sample.lab",),
    "firefly_sample.reference": ("firefly_sample.lab.reference",),
}
"""The new names for each old one that users may still have in their files; the first that exists counts."""


def printable(text: str) -> str:
    """Return a text in which characters that cannot be printed, such as line ends, are written as escapes."""
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() else ascii(char)[1:-1] for char in text)


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a hint for a message about an unknown name: its new name, or else the nearest of `known`.

    It is empty if there is neither. Options and keys may have dashes.
    """
    from difflib import get_close_matches

    known = list(known)
    for new in RENAMED.get(_plain(name), ()):
        for other in known:
            if _plain(other) == new:
                return f" (it is now called {other!r})"
    close = get_close_matches(str(name), known, n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def _plain(name: object) -> str:
    return str(name).lstrip("-").replace("-", "_")
