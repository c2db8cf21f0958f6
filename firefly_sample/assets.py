"""The folders of shaders and models, in an installed wheel or in a checkout."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from pathlib import Path

from firefly_sample.errors import FireflyError


@cache
def asset_dir(kind: str) -> Path:
    """Return the folder "shaders" or "models"; raise a FireflyError if the installation has none."""
    package = Path(str(files("firefly_sample")))
    candidates = (package / "_assets" / kind, package.parent / kind)
    for path in candidates:
        if path.is_dir():
            return path
    raise FireflyError(
        f"the package's {kind}/ folder is missing (looked in {candidates[0]} and {candidates[1]}): "
        "reinstall firefly_sample"
    )


def model_path(name: str) -> Path:
    """Return the file of the model `name`, for example ``terrain.glb``."""
    return asset_dir("models") / name
