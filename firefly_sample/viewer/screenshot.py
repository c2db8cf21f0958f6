"""Save screenshots, which never overwrite one another."""

from __future__ import annotations

from contextlib import suppress
from io import BytesIO
from itertools import count
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import FireflyError


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
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FireflyError(f"cannot write into {folder}: {error.strerror or error}") from error
    for number in count(1):
        path = folder / f"{name}_{number:04d}.png"
        try:
            # exclusive, so that two windows that save at the same time get different names
            with path.open("xb") as file:
                file.write(png.getbuffer())
        except FileExistsError:
            continue
        except OSError as error:
            with suppress(OSError):
                path.unlink()
            raise FireflyError(f"cannot write {path}: {error.strerror or error}") from error
        return path
    raise AssertionError("count never ends")
