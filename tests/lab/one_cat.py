"""A scene of one model from a file: what a cache of models has to do with, and no more."""

from __future__ import annotations

from firefly_sample.assets import model_path
from firefly_sample.model.load import load_model
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes.plugin import Plugin


def build() -> Scene:
    scene = Scene()
    load_model(model_path("cat.glb")).reparent_to(scene.root)
    scene.root.attach_new_node(DirectionalLight("sun")).set_hpr(30, -40, 0)
    scene.camera.set_pos(0, -3, 0.5)
    return scene


one_cat = Plugin("one_cat", "A cat in the sun.", (), build)
