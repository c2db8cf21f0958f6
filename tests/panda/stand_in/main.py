"""A program whose graph is built like that of Panda3D's sample "fireflies": its own art, shaders and numbers.

It runs in a folder that `tests.panda.stand_in.art.write_art` has filled.
"""

import random

from direct.interval.IntervalGlobal import LerpPosInterval, Sequence
from direct.showbase.ShowBase import ShowBase
from panda3d import core

MODELS, LIGHTS, PLAIN = 1, 2, 4
ADD, ONE = core.ColorBlendAttrib.M_add, core.ColorBlendAttrib.O_one


class StandIn(ShowBase):
    """Ten models that come later, and flies, one more each second."""

    def __init__(self):
        super().__init__()
        self.disable_mouse()
        self.set_background_color(0, 0, 0, 0)
        self.camLens.set_near_far(50, 500)
        self.camera.set_pos_hpr(0, -200, 60, 0, -10, 0)
        self.render.clear_light()
        self.render.set_state(core.RenderState.make_empty())
        self.render.set_texture(self.loader.load_texture("white.png"), 0)
        surfaces, sums = self.buffer("surfaces", 1, 1), self.buffer("sums", 0, 2)
        self.win.sort = 3
        textures = {name: core.Texture(name) for name in ("base", "stored", "depth", "sum")}
        textures["depth"].set_format(core.Texture.F_depth_stencil)
        planes = core.GraphicsOutput
        for buffer, name, plane in (
            (surfaces, "depth", planes.RTP_depth_stencil),
            (surfaces, "base", planes.RTP_color),
            (surfaces, "stored", planes.RTP_aux_rgba_0),
            (sums, "sum", planes.RTP_color),
        ):
            buffer.add_render_texture(textures[name], planes.RTM_bind_or_copy, plane)
        self.eyes(surfaces, sums, textures)
        card = sums.get_texture_card()
        card.set_texture(textures["sum"])
        card.reparent_to(self.render2d)

        self.lights = self.render.attach_new_node("lights")
        self.lights.hide(core.BitMask32(MODELS))
        self.forest = self.render.attach_new_node("forest")
        self.forest.hide(core.BitMask32(LIGHTS | PLAIN))
        self.ball = self.loader.load_model("misc/sphere")
        maker = core.CardMaker("spark")
        maker.set_frame(-1, 1, -1, 1)
        self.spark = core.NodePath(maker.generate())
        self.spark.set_texture(self.loader.load_texture("spark.png"))
        self.spark.set_attrib(core.ColorBlendAttrib.make(ADD, core.ColorBlendAttrib.O_incoming_alpha, ONE))
        self.loader.load_model([f"model{k}.bam" for k in range(10)], callback=self.plant)

    def buffer(self, name, aux, sort):
        wanted = core.FrameBufferProperties()
        wanted.set_rgba_bits(8, 8, 8, 8)
        wanted.set_depth_bits(1)
        wanted.set_aux_rgba(aux)
        pipe = core.GraphicsPipe
        flags = pipe.BF_size_track_host | pipe.BF_can_bind_every | pipe.BF_rtt_cumulative
        made = self.graphicsEngine.make_output(
            self.pipe, name, -2, wanted, core.WindowProperties(), flags | pipe.BF_refuse_window,
            self.win.gsg, self.win,
        )  # fmt: skip
        made.sort = sort
        made.set_clear_color((0, 0, 0, 0))
        return made

    def eyes(self, surfaces, sums, textures):
        """The three cameras, and the states with which they begin."""
        self.cam.node().set_active(False)
        models, lights, plain = (
            self.make_camera(buffer, lens=self.camLens, scene=self.render, mask=mask, sort=mask)
            for buffer, mask in ((surfaces, MODELS), (sums, LIGHTS), (sums, PLAIN))
        )
        for eye in (models, lights, plain):
            eye.node().get_display_region(0).disable_clears()
        first = core.NodePath("state")
        first.set_attrib(core.AlphaTestAttrib.make(core.RenderAttrib.M_greater_equal, 0.5))
        first.set_attrib(core.DepthTestAttrib.make(core.RenderAttrib.M_less_equal))
        first.set_shader(self.loader.load_shader("surfaces.sha"))
        models.node().set_initial_state(first.get_state())
        then = core.NodePath("state")
        then.set_shader(self.loader.load_shader("shine.sha"))
        for name in ("base", "stored", "depth"):
            then.set_shader_input(name, textures[name])
        projection = self.camLens.get_projection_mat()
        cells = [projection.get_cell(*at) for at in ((0, 0), (1, 2), (2, 1), (3, 2))]
        then.set_shader_input("lens", core.LVecBase4(*cells))
        then.set_attrib(core.ColorBlendAttrib.make(ADD, ONE, ONE))
        then.set_attrib(core.CullFaceAttrib.make(core.CullFaceAttrib.M_cull_counter_clockwise))
        then.set_depth_write(False)
        then.set_depth_test(False)
        lights.node().set_initial_state(then.get_state())

    def plant(self, models):
        for model in models:
            model.reparent_to(self.forest)
        for number in range(12):
            self.add_fly(number)
        self.next = 1.0
        self.task_mgr.add(self.spawn, "spawn")

    def spawn(self, task):
        if self.clock.frame_time >= self.next - 1e-6:
            self.next += 1.0
            self.add_fly(len(self.lights.children))
        return task.cont

    def add_fly(self, number):
        color = 1.0, random.uniform(0.5, 1.0), 0.5
        fly = self.lights.attach_new_node("fly")
        fly.set_color(*color, 1)
        fly.set_shader_input("lightcolor", *color, 1.0)
        fly.set_scale(1.0 - 0.1 * (number % 3))
        place = core.Point3(-60 + 30 * (number % 4), -30 + 45 * (number // 4), 14 + 9 * (number % 3))
        Sequence(
            LerpPosInterval(fly, 8, place + core.Vec3(20, 0, 0), place), LerpPosInterval(fly, 8, place)
        ).loop()
        glow, dot = fly.attach_new_node("glow"), fly.attach_new_node("dot")
        self.ball.instance_to(glow)
        glow.set_scale(60)
        glow.hide(core.BitMask32(MODELS | PLAIN))
        self.spark.instance_to(dot)
        dot.hide(core.BitMask32(MODELS | LIGHTS))
        dot.set_color(*color, 1)


StandIn().run()
