"""Other libraries that draw with OpenGL, by one interface.

``python -m tests.viewer.hosts theirs`` lets each of them and a Renderer take turns, asserts that neither
changes what the other draws, and prints checksums of both pictures. With "theirs" each library draws before
there is a Renderer; with "ours" one Renderer is made before all of them and outlives them.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import sys
import warnings

import numpy as np

SIZE = (64, 48)
GL_STATE = (
    *(0x8B8D, 0x85B5, 0x8CA6, 0x8CAA, 0x8894),  # program, vertex array, framebuffers, buffer
    *(0x84E0, 0x8069, 0x8919, 0x0BA2, 0x0C10),  # active texture, its texture and sampler, viewport, scissor
    *(0x0BE2, 0x0B71, 0x0B44, 0x0C11, 0x0B74, 0x0CF5),  # what is enabled, depth function, unpack alignment
)


def current() -> dict[str, int]:
    """What is current in this thread, asked of the libraries themselves."""
    found = {}
    for file, names in (
        ("libGL.so.1", ("glXGetCurrentContext", "glXGetCurrentDrawable", "glXGetCurrentReadDrawable")),
        ("libEGL.so.1", ("eglGetCurrentContext", "eglGetCurrentDisplay")),
    ):
        library = ctypes.CDLL(file)
        for name in names:
            function = getattr(library, name)
            function.restype = ctypes.c_void_p
            found[name] = function() or 0
    return found


def gl_state() -> list[tuple[int, ...]]:
    """What OpenGL's current context has set, and its error."""
    gl, values = ctypes.CDLL("libGL.so.1"), []
    for name in GL_STATE:
        numbers = (ctypes.c_int * 4)()
        gl.glGetIntegerv(name, numbers)
        values.append(tuple(numbers))
    return [*values, (gl.glGetError(),)]


class RawHost:
    """A library that opens a window and leaves the drawing to OpenGL itself; it leaves samplers bound."""

    def __init__(self) -> None:
        self.open()
        from OpenGL import GL

        self.gl = GL
        self.texture, self.sampler, self.buffer = GL.glGenTextures(1), GL.glGenSamplers(1), GL.glGenBuffers(1)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self.texture)
        texels = np.arange(48, dtype=np.uint8)
        GL.glTexImage2D(
            GL.GL_TEXTURE_2D, 0, GL.GL_RGB8, 4, 4, 0, GL.GL_RGB, GL.GL_UNSIGNED_BYTE, texels.tobytes()
        )
        self.target = GL.glGenFramebuffers(1)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self.target)
        attachment = (GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0, GL.GL_TEXTURE_2D)
        GL.glFramebufferTexture2D(*attachment, self.texture, 0)
        GL.glSamplerParameteri(self.sampler, GL.GL_TEXTURE_MIN_FILTER, GL.GL_NEAREST_MIPMAP_NEAREST)
        for unit in range(16):
            GL.glBindSampler(unit, self.sampler)
        GL.glEnable(GL.GL_SCISSOR_TEST)
        GL.glScissor(1, 1, 2, 2)
        GL.glEnable(GL.GL_BLEND)
        GL.glColorMask(True, False, True, True)
        GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self.buffer)
        GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 2)

    def open(self) -> None:
        raise NotImplementedError

    def close(self) -> None:
        raise NotImplementedError

    def draw(self) -> bytes:
        """Clear a part of the texture, and read it all."""
        gl = self.gl
        gl.glClearColor(0.5, 0.5, 0.25, 1.0)
        gl.glClear(gl.GL_COLOR_BUFFER_BIT)
        return bytes(gl.glReadPixels(0, 0, 4, 4, gl.GL_RGB, gl.GL_UNSIGNED_BYTE))


class Glfw(RawHost):
    def open(self) -> None:
        import glfw

        glfw.init()
        glfw.window_hint(glfw.VISIBLE, False)
        self.window = glfw.create_window(*SIZE, "glfw", None, None)
        glfw.make_context_current(self.window)

    def close(self) -> None:
        import glfw

        glfw.terminate()


class Pyglet(RawHost):
    def open(self) -> None:
        import pyglet

        pyglet.options["shadow_window"] = False
        self.window = pyglet.window.Window(*SIZE, visible=False)
        self.window.switch_to()

    def close(self) -> None:
        self.window.close()


class Panda:
    """A window of Panda3D's with a lit, textured card, drawn by Panda3D itself."""

    def __init__(self) -> None:
        from direct.showbase.ShowBase import ShowBase
        from panda3d.core import CardMaker, DirectionalLight, PNMImage, SamplerState, Texture, loadPrcFileData

        loadPrcFileData("", f"win-size {SIZE[0]} {SIZE[1]}\naudio-library-name null\nsync-video 0\n")
        loadPrcFileData("", "notify-level error\nnotify-level-display error\n")
        self.base = ShowBase(windowType="onscreen")
        image = PNMImage(8, 8)
        for x, y in np.ndindex(8, 8):
            image.set_xel(x, y, x / 8, y / 8, (x * y) % 3 / 2)
        texture = Texture()
        texture.load(image)
        texture.set_minfilter(SamplerState.FT_nearest_mipmap_nearest)
        card = CardMaker("card")
        card.set_frame(-1, 1, -1, 1)
        card.set_has_normals(True)
        path = self.base.render.attach_new_node(card.generate())
        path.set_texture(texture)
        path.set_pos(0, 4, 0)
        light = self.base.render.attach_new_node(DirectionalLight("sun"))
        light.set_hpr(20, -30, 0)
        path.set_light(light)
        path.set_shader_auto()
        self.kept = Texture()
        self.base.win.add_render_texture(self.kept, self.base.win.RTM_copy_ram)

    def draw(self) -> bytes:
        self.base.graphics_engine.render_frame()
        self.base.graphics_engine.render_frame()
        return bytes(self.kept.get_ram_image())

    def close(self) -> None:
        self.base.destroy()


class Pyrender:
    """pyrender without a window, by EGL, as this package is."""

    def __init__(self) -> None:
        os.environ["PYOPENGL_PLATFORM"] = "egl"
        import pyrender
        import trimesh

        self.renderer = pyrender.OffscreenRenderer(*SIZE)
        self.scene = pyrender.Scene(bg_color=(90, 20, 0, 255))
        self.scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.box((1, 1, 1))))
        pose = np.eye(4)
        pose[2, 3] = 3.0
        self.scene.add(pyrender.PerspectiveCamera(yfov=1.0), pose=pose)
        self.scene.add(pyrender.DirectionalLight(intensity=3.0), pose=pose)

    def draw(self) -> bytes:
        return bytes(self.renderer.render(self.scene)[0].tobytes())

    def close(self) -> None:
        """Shut down the EGL display, for everybody in this process."""
        self.renderer.delete()


HOSTS = {"panda3d": Panda, "pyglet": Pyglet, "glfw": Glfw, "pyrender": Pyrender}


def lit_wall():
    """A scene of ours: a wall with a light before it."""
    from firefly_sample import Geom, GeomNode, Material, PointLight, Scene

    scene, node = Scene(), GeomNode("wall")
    corners = [(-4, 6, -3), (4, 6, -3), (4, 6, 3), (-4, 6, 3)]
    node.add_geom(Geom(corners, [(0, 1, 2), (0, 2, 3)]), Material("wall"))
    scene.root.attach_new_node(node)
    scene.root.attach_new_node(PointLight("lamp", radius=8.0)).set_pos(1, 4, 0)
    return scene


class Ours:
    """A Renderer and what it draws."""

    def __init__(self) -> None:
        from firefly_sample import Renderer

        self.renderer, self.scene = Renderer(SIZE), lit_wall()

    def draw(self) -> bytes:
        return bytes(self.renderer.render(self.scene).color.tobytes())


def take_turns(name: str, ours: Ours | None) -> None:
    """Draw with a library and a Renderer of the same thread in turn, and assert that nothing differs."""
    before = [ours.draw()] if ours is not None else []
    host, made = HOSTS[name](), ours is None
    theirs = [host.draw()]
    held, state = current(), gl_state()
    assert held["glXGetCurrentContext" if name != "pyrender" else "eglGetCurrentContext"]

    def check(after: str) -> None:
        assert (current(), gl_state()) == (held, state), f"{name}, after {after}"

    if ours is None:
        ours = Ours()
        check("making a Renderer")
    for _ in range(2):
        before.append(ours.draw())
        check("drawing")
        theirs.append(host.draw())
        held, state = current(), gl_state()
    try:
        ours.renderer.render(ours.scene, 0.0, "no such output")
        raise AssertionError("drawn")
    except ValueError:
        check("an error")
    if made:
        ours.renderer.close()
        check("closing")
    theirs.append(host.draw())
    for pictures in (theirs, before):
        assert len(set(pictures)) == 1, (
            f"{name}: {[hashlib.sha256(picture).hexdigest() for picture in pictures]}"
        )
        assert len(set(pictures[0])) > 2, f"{name}: an empty picture"
        print(name, hashlib.sha256(pictures[0]).hexdigest())
    host.close()


def outlive_the_display(ours: Ours) -> None:
    """Assert that a Renderer says why it cannot draw any more, and that a new one can."""
    refusal = "none"
    try:
        ours.draw()
    except RuntimeError as error:
        refusal = str(error)
    assert "context is gone" in refusal, refusal
    assert "pyrender" in refusal
    ours.renderer.close()
    again = Ours()
    print("again", hashlib.sha256(again.draw()).hexdigest())
    again.renderer.close()


def main(order: str) -> None:
    ours = Ours() if order == "ours" else None
    for name in HOSTS:
        take_turns(name, ours)
    if ours is not None:
        outlive_the_display(ours)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main(*sys.argv[1:])
