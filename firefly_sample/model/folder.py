"""The files beside a model that it names: material libraries and textures."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

from firefly_sample.losses import Losses
from firefly_sample.model.data import ImageData
from firefly_sample.model.pixels import UnreadableImageError, open_image


class Folder:
    """The folder of a model, out of which nothing is read.

    Parameters
    ----------
    model : Path
        The model's file.
    losses : Losses
        Notes the files that are missing or outside.
    max_texture_megapixels : float
    """

    def __init__(self, model: Path, losses: Losses, max_texture_megapixels: float) -> None:
        self.model = model
        self.root = model.parent.resolve()
        self.losses = losses
        self.max_texture_megapixels = max_texture_megapixels
        self.images: dict[str, ImageData | None] = {}

    def find(self, name: str) -> Path | None:
        r"""Return the file of this name, or else the file in the model's folder that is called so.

        Names may have slashes of both kinds. A path of another machine, such as C:\textures\wood.png, thus
        finds wood.png beside the model.
        """
        plain = name.strip().strip('"').replace("\\", "/")
        for candidate in (plain, PurePosixPath(plain).name):
            try:
                path = (self.root / candidate).resolve()
                if path.is_relative_to(self.root) and path.is_file():
                    return path
            except (OSError, ValueError, RuntimeError):  # too long, with a null, or a loop of links
                continue
        return None

    def read(self, name: str, what: str) -> bytes | None:
        """Return the content of a file; None, and a loss of `what`, if it is missing or outside."""
        path = self.find(name)
        if path is not None:
            try:
                return path.read_bytes()
            except OSError:
                pass
        self.losses.add(f"{what} not found in the model's folder", name.strip())
        return None

    def image(self, name: str) -> ImageData | None:
        """Return an image file, not yet decoded; None, and a loss, if there is none.

        Raises
        ------
        ModelError
            If it has more pixels than allowed.
        """
        if name not in self.images:
            data = self.read(name, "textures")
            self.images[name] = None if data is None else self._opened(name, data)
        return self.images[name]

    def _opened(self, name: str, data: bytes) -> ImageData | None:
        shown = PurePosixPath(name.strip().replace("\\", "/")).name
        what = f"model {self.model}: the texture {shown!r}"
        try:
            return open_image(data, shown, what, self.max_texture_megapixels)
        except UnreadableImageError:
            self.losses.add("textures that are no images which can be read", name.strip())
            return None
