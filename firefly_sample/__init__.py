"""Many lights, deferred, measured: a night forest with hundreds of fireflies in Python and OpenGL 3.3.

The names below are what most users need; each is imported when it is first asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from firefly_sample.errors import RENAMED

if TYPE_CHECKING:
    from firefly_sample.camera import FrameCamera
    from firefly_sample.capture.sequence import capture_frames
    from firefly_sample.capture.verify import compare_captures, verify_capture
    from firefly_sample.compositing import composite
    from firefly_sample.errors import FireflyError, NoEffectWarning, SoftwareDriverWarning
    from firefly_sample.frame import Frame
    from firefly_sample.model.framing import frame_camera
    from firefly_sample.model.load import load_model
    from firefly_sample.model.studio import add_default_lights, add_ground
    from firefly_sample.pipeline import build_plan
    from firefly_sample.renderer import Renderer
    from firefly_sample.scene.geom import Geom, GeomNode
    from firefly_sample.scene.intrinsics import Intrinsics
    from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
    from firefly_sample.scene.light import Attenuation
    from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
    from firefly_sample.scene.material import Material
    from firefly_sample.scene.node import PandaNode
    from firefly_sample.scene.nodepath import NodePath
    from firefly_sample.scene.parameter import KeyStep, Parameter
    from firefly_sample.scene.particles import ParticleNode, ParticleShadow
    from firefly_sample.scene.scene import Camera, Scene
    from firefly_sample.scene.texture import Texture
    from firefly_sample.scenes.model import model_scene
    from firefly_sample.settings import Settings

    __version__: str

__all__ = [
    "AmbientLight",
    "Attenuation",
    "Camera",
    "DirectionalLight",
    "FireflyError",
    "Frame",
    "FrameCamera",
    "Geom",
    "GeomNode",
    "Intrinsics",
    "KeyStep",
    "Material",
    "NoEffectWarning",
    "NodePath",
    "OrthographicLens",
    "PandaNode",
    "Parameter",
    "ParticleNode",
    "ParticleShadow",
    "PerspectiveLens",
    "PointLight",
    "PointLights",
    "Renderer",
    "Scene",
    "Settings",
    "SoftwareDriverWarning",
    "Spotlight",
    "Texture",
    "__version__",
    "add_default_lights",
    "add_ground",
    "build_plan",
    "capture_frames",
    "compare_captures",
    "composite",
    "frame_camera",
    "load_model",
    "model_scene",
    "verify_capture",
]

_MODULES = {
    "camera": ("FrameCamera",),
    "capture.sequence": ("capture_frames",),
    "capture.verify": ("compare_captures", "verify_capture"),
    "compositing": ("composite",),
    "errors": ("FireflyError", "NoEffectWarning", "SoftwareDriverWarning"),
    "frame": ("Frame",),
    "model.framing": ("frame_camera",),
    "model.load": ("load_model",),
    "model.studio": ("add_default_lights", "add_ground"),
    "pipeline": ("build_plan",),
    "renderer": ("Renderer",),
    "scene.geom": ("Geom", "GeomNode"),
    "scene.intrinsics": ("Intrinsics",),
    "scene.lens": ("OrthographicLens", "PerspectiveLens"),
    "scene.light": ("Attenuation",),
    "scene.lights": ("AmbientLight", "DirectionalLight", "PointLight", "PointLights", "Spotlight"),
    "scene.material": ("Material",),
    "scene.texture": ("Texture",),
    "scene.node": ("PandaNode",),
    "scene.nodepath": ("NodePath",),
    "scene.parameter": ("KeyStep", "Parameter"),
    "scene.particles": ("ParticleNode", "ParticleShadow"),
    "scene.scene": ("Camera", "Scene"),
    "scenes.model": ("model_scene",),
    "settings": ("Settings",),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for, and keep it."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("firefly_sample")
    elif name in _HOMES:
        value = getattr(import_module(f"firefly_sample.{_HOMES[name]}"), name)
    else:
        text = f"module 'firefly_sample' has no attribute {name!r}"
        for new in RENAMED.get(name, ()):
            if new in __all__:
                # `from firefly_sample import name` would hide the text of an AttributeError
                raise ImportError(f"{text}: it is now called {new!r}")
        raise AttributeError(text)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
