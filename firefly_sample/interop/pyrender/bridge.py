"""Convert scenes to pyrender and back: pip install 'firefly_sample[pyrender]'.

pyrender 0.1.45 and its successor pyrender-maintained have the same import name; either one works. To compare
pictures by glTF's formula, draw ours with ``Settings(tone="none")``, and note that pyrender's
`OffscreenRenderer`

- encodes colours by the power 1/2.2, where ours are sRGB, and has no tone curve;
- gives depth 0 where nothing is drawn, where ours is infinite;
- takes depth at one of four samples of a pixel, not at the pixel's centre;
- decodes the depth of an orthographic camera as if it were a perspective one;
- lights the back sides of double-sided surfaces by the normal of their front sides;
- gives every surface that is no metal a highlight of 4 %, and draws at most four lights of a kind;
- differs from glTF in some terms of its metallic-roughness materials, which docs/pyrender.md lists;
- shuts down EGL for the whole process in `delete`: close every `Renderer` before it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from firefly_sample.errors import SceneError
from firefly_sample.frame import check_size
from firefly_sample.interop.pyrender.cameras import Size
from firefly_sample.interop.pyrender.package import import_pyrender
from firefly_sample.interop.pyrender.scenes import SceneReader, SceneWriter
from firefly_sample.losses import Losses
from firefly_sample.scene.scene import Scene

if TYPE_CHECKING:
    import pyrender


def to_pyrender(scene: Scene, time: float = 0.0, *, size: Size | None = None) -> pyrender.Scene:
    """Return a scene at a time as a new pyrender Scene, which is independent of it.

    Every node becomes a pyrender Node with the same name, transform and parent (one Node per parent), and all
    axes are turned from Z-up to Y-up. Nodes that show the same Geoms share one pyrender Mesh. Geometry that
    is hidden from the scene's camera becomes an invisible Mesh. Colours and materials that nodes set for
    their subtrees become those of pyrender's materials.

    `firefly_sample.interop.pyrender.lights` documents the conversion of lights, which is exact for an
    inverse-square attenuation. Each light of a `PointLights`, and each light or camera that needs a transform
    of its own (a light's direction, a scaled camera, the film offset of an orthographic lens), gets a child
    Node.

    Transforms, cameras and intensities stay float64; pyrender keeps vertices and colours as float32. The
    background becomes an sRGB colour, as pyrender shows it. Base colours, metalness, roughness and emission,
    all textures and their samplers, alpha mode and cut-off, sidedness and tangents are kept. Phong materials
    become matt (metalness 0, roughness 1).

    Parameters
    ----------
    scene : Scene
        Its ``update(time)`` is called.
    time : float
        Seconds.
    size : (int, int), optional
        Width and height in pixels of the picture to be drawn. Lenses take its aspect ratio, as when the
        `Renderer` draws, with a warning if they had a different one; without it, cameras keep their own.

    Raises
    ------
    MissingPackageError
        If pyrender is not installed.
    LensError
        If the film of a perspective lens is off centre and there is no `size`, because pyrender measures it
        in pixels; if the scene's camera has intrinsics for pictures of another aspect ratio than `size`. The
        message names the camera.
    SceneError
        If `scene` is not a Scene, a Geom has more than 2^24 vertices, or the `Renderer` would also refuse the
        scene: for a camera's or spotlight's transform, or the arrays of lights.
    OutputError
        If `size` is not two whole numbers of 1 or more.

    Warns
    -----
    ConversionWarning
        Once for each kind of loss, with the names of the objects: sprites, highlights, ambient colours of
        materials, unlit materials, scales of normal maps, occlusion, cut-outs, a spotlight's exponent,
        attenuation other than 1/d^2, shadows, more than four lights of a kind, exposure, a background's
        gradient, aspect ratios that contradict `size`, sizes of points, tags and more.
    """
    import_pyrender()
    _check_type("to_pyrender", scene, Scene)
    losses = Losses()
    scene.update(time)
    written = SceneWriter(scene, time, None if size is None else check_size(size), losses).write()
    losses.warn(stacklevel=2)
    return written


def from_pyrender(scene: pyrender.Scene, *, size: Size | None = None) -> Scene:
    """Return a pyrender Scene as a new Scene, which is independent of it.

    This reverses `to_pyrender`: nodes keep names, transforms and their tree, axes are turned to Z-up, nodes
    that share a Mesh share its Geoms, and each light becomes a `PointLight`, `Spotlight` or
    `DirectionalLight`. If a pyrender Scene without a name has a single top node, that becomes the root.
    Otherwise a new root is added, with the top nodes sorted by name (equal names keep their order). A node
    without a name takes that of its mesh, light or camera, or one such as "mesh 2". An ambient light becomes
    an `AmbientLight`; instances (`Primitive.poses`) and wireframes become nodes below that of their mesh.
    Strips and fans become triangles, points and lines stay what they are. A Mesh without normals gets smooth
    ones. A Scene without a main camera gets a new camera.

    A MetallicRoughnessMaterial becomes a metallic-roughness material, also one of metalness 0 and roughness
    1, which `to_pyrender` may have made of a Phong material: pyrender draws a highlight on it. The range of
    a light becomes its max distance, at which it ends as glTF recommends; in pyrender it shines beyond.

    Parameters
    ----------
    scene : pyrender.Scene
    size : (int, int), optional
        Width and height in pixels of the picture to be drawn. IntrinsicsCameras are taken to be for it, and
        PerspectiveCameras of another aspect ratio are stretched to it, as in pyrender. A camera of another
        class has the lens of its projection matrix for it.

    Raises
    ------
    MissingPackageError
        If pyrender is not installed.
    LensError
        If there is an IntrinsicsCamera and no `size`, or a camera that cannot become a lens; the message
        names it.
    SceneError
        If `scene` is not a pyrender Scene, a transform, light or material has a number that is not finite or
        out of its range, or a mesh has a wrong index.
    OutputError
        If `size` is not two whole numbers of 1 or more.

    Warns
    -----
    ConversionWarning
        Once for each kind of loss, with the names of the objects: gloss, occlusion, ranges of lights,
        numbers of meshes that are not finite, and more.
    """
    check_scene("from_pyrender", scene)
    losses = Losses()
    read = SceneReader(scene, None if size is None else check_size(size), losses).read()
    losses.warn(stacklevel=2)
    return read


def check_scene(function: str, scene: object) -> None:
    """Raise SceneError if what a function was given is no pyrender Scene."""
    _check_type(function, scene, import_pyrender().Scene)


def _check_type(function: str, scene: object, wanted: type) -> None:
    if not isinstance(scene, wanted):
        module = wanted.__module__.partition(".")[0]
        raise SceneError(f"{function} takes a {module}.{wanted.__name__}, got {scene!r}")
