"""pyrender's names, with an `OffscreenRenderer` that draws by this package.

``import firefly_sample.interop.pyrender as pyrender`` runs a script that draws with pyrender. Its scenes are
built of pyrender's own classes; docs/pyrender.md says what is different in its pictures.

pyrender's submodules are there by their names, too: ``from firefly_sample.interop.pyrender.constants import
RenderFlags``. `to_pyrender` and `from_pyrender` convert scenes.
"""

from __future__ import annotations

import sys
from typing import Any

from firefly_sample.interop.pyrender.bridge import from_pyrender as from_pyrender
from firefly_sample.interop.pyrender.bridge import to_pyrender as to_pyrender
from firefly_sample.interop.pyrender.offscreen import OffscreenRenderer as OffscreenRenderer
from firefly_sample.interop.pyrender.package import import_pyrender

_OURS = "OffscreenRenderer", "from_pyrender", "to_pyrender"


def __getattr__(name: str) -> Any:
    if name.startswith("__") and name not in ("__all__", "__version__"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    pyrender = import_pyrender()
    if name == "__all__":
        return sorted({*pyrender.__all__, *_OURS})
    try:
        return getattr(pyrender, name)
    except AttributeError:
        raise AttributeError(f"neither {__name__!r} nor pyrender has an attribute {name!r}") from None


def __dir__() -> list[str]:
    return sorted({*globals(), *dir(import_pyrender())})


def _name_submodules() -> None:
    """Let pyrender's submodules be imported from this package, as the same modules."""
    try:
        import_pyrender()
    except ImportError:
        return  # the first use of a name says so
    for name, module in list(sys.modules.items()):
        if name.startswith("pyrender."):
            sys.modules.setdefault(f"{__name__}.{name.removeprefix('pyrender.')}", module)


_name_submodules()
