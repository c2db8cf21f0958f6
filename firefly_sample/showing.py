"""Pictures shown to a person: in the notebook, or by the desktop's program for pictures."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ViewerError

_INSTEAD = "write it to a file, or make a frame the last line of a notebook's cell"


def png_bytes(picture: NDArray[np.uint8]) -> bytes:
    """Return a picture, shape (height, width) or (height, width, 3 or 4), as the content of a PNG file."""
    import io

    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG")
    return file.getvalue()


def show_picture(picture: NDArray[np.uint8], title: str) -> None:
    """Show a picture, shape (height, width, 3 or 4), in the notebook's cell or in a window of the desktop.

    Raises
    ------
    ViewerError
        If there is neither, or no program that Pillow knows (see its module ``ImageShow``).
    """
    from PIL import Image, ImageShow

    image = Image.fromarray(picture)
    if _in_notebook():
        sys.modules["IPython"].display.display(image)
        return
    if sys.platform not in ("darwin", "win32") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise ViewerError(f"{title}: this process has no display (DISPLAY is not set): {_INSTEAD}")
    if not ImageShow.show(image, title):
        raise ViewerError(
            f"{title}: Pillow finds no program that shows pictures, as xdg-open does: {_INSTEAD}"
        )


def _in_notebook() -> bool:
    """Return whether a Jupyter kernel runs this process; a terminal's IPython shows no pictures."""
    ipython: Any = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")
