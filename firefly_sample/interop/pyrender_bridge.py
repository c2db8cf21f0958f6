"""Scenes to pyrender and back: pip install 'firefly_sample[pyrender]'.

pyrender 0.1.45 and its successor pyrender-maintained are imported by the same name, and either serves. For a
comparison of pictures, draw ours with ``Settings(tone="none")``, and note that pyrender's `OffscreenRenderer`

- encodes colours by the power 1/2.2, where ours are sRGB, and has no tone curve;
- gives depth 0 where nothing is drawn, where ours is infinite;
- takes depth at one of four samples of a pixel, not at the pixel's centre;
- reads depth under an orthographic camera as if it were a perspective one's;
- lights back sides of double-sided surfaces by the normal of their front sides;
- gives matt surfaces a highlight of 4 %, and draws at most four lights of a kind;
- shuts down EGL for the whole process in `delete`: close every `Renderer` before it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from firefly_sample.errors import MissingPackageError, SceneError
from firefly_sample.extras import install_command
from firefly_sample.frame import check_size
from firefly_sample.interop.losses import Losses
from firefly_sample.interop.pyrender_cameras import Size
from firefly_sample.interop.pyrender_reader import read_scene
from firefly_sample.interop.pyrender_writer import write_scene
from firefly_sample.scene.scene import Scene

if TYPE_CHECKING:
    import pyrender


def to_pyrender(scene: Scene, time: float = 0.0, *, size: Size | None = None) -> pyrender.Scene:
    """A pyrender Scene of what `scene` is at a time.

    Every node becomes a pyrender Node of its name, transform and place in the tree (a node with several
    parents, one for each), and all axes are turned from Z-up to Y-up; see `firefly_sample.scene.transforms`. Nodes
    that show the same Geoms share one pyrender Mesh. What the scene's camera does not see is an invisible
    Mesh. Colours and materials that nodes give to what is below them become those of materials.

    Lights are converted as `firefly_sample.interop.pyrender_lights` says, exactly where they fade by the
    square of the distance; each of a `PointLights` is a node of its own. A light or camera that does not
    stand in its node as pyrender wants it (a light's own direction, a scaled camera, the film offset of an
    orthographic lens) is put on a node below.

    Transforms, cameras and intensities stay float64; pyrender keeps vertices and colours as float32. The
    background becomes an sRGB colour, as pyrender shows it. Base colours, their textures, alpha mode and
    cut-off, sidedness and emission are kept; surfaces are matt (metalness 0, roughness 1).

    Parameters
    ----------
    scene : Scene
        Its ``update(time)`` is called.
    time : float
        Seconds.
    size : (int, int), optional
        Width and height in pixels of the picture to be drawn. Lenses take its shape, as when the `Renderer`
        draws, with a warning where another was set; without it, cameras keep their lenses' own aspect ratio.

    Returns
    -------
    pyrender.Scene
        New, and independent of `scene`.

    Raises
    ------
    MissingPackageError
        If pyrender is not installed.
    LensError
        If the film of a perspective lens is off centre and there is no `size`: pyrender measures in pixels.
        If the scene's camera has intrinsics for pictures of another shape than `size` has. It names the
        camera.
    SceneError
        If `scene` is something else, a Geom has more than 2^24 vertices, or for what the `Renderer` would
        refuse as well: a camera's or spotlight's transform, the arrays of lights.
    OutputError
        If `size` is not two whole numbers of 1 or more.

    Warns
    -----
    ConversionWarning
        Once for each kind of thing that pyrender lacks, or would not draw: sprites, highlights, ambient
        colours of materials, cut-outs, a spotlight's exponent, fading other than by 1/d^2, shadows, more
        than four lights of a kind, exposure, a background's gradient, aspect ratios that contradict `size`,
        tags and more. It names whose.
    """
    _check_pyrender()
    _check_type("to_pyrender", scene, Scene)
    losses = Losses()
    written = write_scene(scene, time, None if size is None else check_size(size), losses)
    losses.warn(stacklevel=2)
    return written


def from_pyrender(scene: pyrender.Scene, *, size: Size | None = None) -> Scene:
    """A Scene of a pyrender Scene.

    The reverse of `to_pyrender`: nodes keep names, transforms and their tree, axes are turned to Z-up,
    nodes that share a Mesh share its Geoms, and each light becomes a `PointLight`, `Spotlight` or
    `DirectionalLight`. A pyrender Scene without a name whose nodes hang under one becomes a Scene with that
    one as root; otherwise there is a new root, with those below it in the order of their names, and those of
    equal names as they came. A node without a name has that of its mesh, light or camera, or else one such
    as "mesh 2". An ambient light becomes an `AmbientLight`; instances (`Primitive.poses`) become nodes;
    strips and fans become triangles. A Mesh without normals gets some.

    The range of a light becomes its max distance, where it ends as glTF recommends; pyrender shines on.
    An emissive texture becomes its mean colour in linear light, a factor of the material's emission.

    Parameters
    ----------
    scene : pyrender.Scene
    size : (int, int), optional
        Width and height in pixels of the picture to be drawn. IntrinsicsCameras are meant for it, and
        PerspectiveCameras of another aspect ratio are stretched to it, as in pyrender.

    Returns
    -------
    Scene
        New, and independent of `scene`; its camera is the main camera, or a new one where there is none.

    Raises
    ------
    MissingPackageError
        If pyrender is not installed.
    LensError
        If there is an IntrinsicsCamera and no `size`, or a camera that no lens can be; it names it.
    SceneError
        If `scene` is something else, or a transform, mesh, light or material has a number that is not finite
        or out of its range.
    OutputError
        If `size` is not two whole numbers of 1 or more.

    Warns
    -----
    ConversionWarning
        Once for each kind of thing that has no equal here or that pyrender draws otherwise: metalness and
        gloss, textures other than the base colour's, points and lines, ranges of lights, and more. It names
        whose.
    """
    _check_pyrender()
    import pyrender

    _check_type("from_pyrender", scene, pyrender.Scene)
    losses = Losses()
    read = read_scene(scene, None if size is None else check_size(size), losses)
    losses.warn(stacklevel=2)
    return read


def _check_type(function: str, scene: object, wanted: type) -> None:
    if not isinstance(scene, wanted):
        module = wanted.__module__.partition(".")[0]
        raise SceneError(f"{function} takes a {module}.{wanted.__name__}, got {scene!r}")


def _check_pyrender() -> None:
    try:
        import pyrender  # noqa: F401
    except ImportError as error:
        raise MissingPackageError(
            f"pyrender cannot be imported ({error}): run {install_command('pyrender')}"
        ) from error
