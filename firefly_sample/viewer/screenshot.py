"""Pictures of the window as files that never overwrite one another."""

from __future__ import annotations

from contextlib import suppress
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import FireflyError

__all__ = ["save_screenshot"]


def save_screenshot(folder: Path, name: str, picture: NDArray[np.uint8]) -> Path:
    """Write `picture`, shape (height, width, 3), to the first free ``<name>_0001.png`` in `folder`.

    Raises
    ------
    FireflyError
        If the folder cannot be written.
    """
    from PIL import Image

    png = BytesIO()
    Image.fromarray(picture).save(png, format="PNG")
    number = 1
    while True:
        path = folder / f"{name}_{number:04d}.png"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            # exclusive: of two windows that save at once, each gets a name of its own
            with path.open("xb") as file:
                file.write(png.getbuffer())
            return path
        except FileExistsError:
            number += 1
        except OSError as error:
            with suppress(OSError):
                path.unlink()
            raise FireflyError(f"cannot write {path}: {error.strerror or error}") from error
