"""A program for Panda3D with 500 moving lights, drawn by FireflyView."""

import random

from direct.gui.DirectGui import DirectButton
from direct.gui.OnscreenText import OnscreenText
from direct.showbase.ShowBase import ShowBase
from panda3d.core import NodePath, PointLight

from firefly_sample.interop.panda3d import FireflyView

base = ShowBase()
base.set_background_color(0.02, 0.02, 0.05)
base.cam.set_pos_hpr(0, -17, 8, 0, -25, 0)


def add(name: str, x: float, y: float, z: float, scale: float) -> NodePath:
    """A model of Panda3D's."""
    model = base.loader.load_model(f"models/{name}")
    model.set_pos_hpr_scale(x, y, z, 0, 0, 0, scale, scale, scale)
    model.reparent_to(base.render)
    return model


ground, teapot = add("box", -10, -10, -20, 20), add("teapot", -3, 0, 0, 0.8)
swarm = base.render.attach_new_node("swarm")
for number in range(500):
    light = PointLight(f"firefly {number}")
    light.set_color((random.uniform(0, 3), random.uniform(0, 3), 0.6, 1))
    light.set_attenuation((1, 0, 100))
    orbit = swarm.attach_new_node("orbit")
    orbit.attach_new_node(light).set_pos(random.uniform(0, 10), 0, random.uniform(0.2, 2))
    orbit.hprInterval(random.uniform(9, 40), (360, 0, 0), (random.uniform(0, 360), 0, 0)).loop()
teapot.hprInterval(8, (360, 0, 0)).loop()
base.task_mgr.do_method_later(3, lambda task: add("panda", 4, 0, 0, 0.4) and task.done, "panda")
OnscreenText("500 fireflies", pos=(0, 0.85), fg=(1, 1, 1, 1))
DirectButton(text="hop", pos=(0, 0, -0.9), scale=0.08, command=lambda: teapot.set_z(1))
view = FireflyView(base)
base.run()
