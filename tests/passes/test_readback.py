"""Every output of a frame is what its targets' texels say, pixel by pixel, whatever the picture's size."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest

from firefly_sample import readback
from firefly_sample.frame import OUTPUTS
from firefly_sample.plan.targets import FORMATS
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.clouds import cloud_scene, puff
from tests.conftest import make_renderer
from tests.scenes import ball, geom_node, wall_scene

NUMBERS = {
    "f4": np.float32,
    "f2": np.float16,
    "f1": np.uint8,
    "nu2": np.uint16,
    "ni2": np.int16,
    "u4": np.uint32,
}
ONE = {"f1": 255.0, "nu2": 65535.0, "ni2": 32767.0}
NARROW = Settings(
    position_method="depth24", normal_format="oct8", albedo_format="srgb8", accumulation_format="r11g11b10f"
)
SETTINGS = {
    "default": Settings(),
    "narrow": NARROW,
    "stored16f": Settings(
        position_method="stored16f",
        normal_format="rgb10a2",
        albedo_format="rgba8",
        particle_shadow_format="unorm8",
        particle_shadows="blend",
    ),
    "stored32f": Settings(position_method="stored32f", normal_format="rgba32f", albedo_format="rgba16f"),
    "depth32f": Settings(position_method="depth32f", normal_format="rgba8", albedo_format="sqrt8"),
}

SURFACES = (
    *("albedo", "normal", "normal_world", "depth", "position", "position_world"),
    *("id", "visibility", "specular", "shininess", "emission"),
)
METALLIC = ("metallic", "roughness")


def every_kind_of_thing(orthographic=False):
    """Shiny, glowing and dull things, lights with volumes, a shadow map, and particles in coloured shadow."""
    scene = cloud_scene(puff(40), tint=0.5)
    tin = Material("tin", (0.2, 0.3, 0.5, 1.0), specular=(0.5, 0.4, 0.3), shininess=20.0)
    glow = Material("glow", (0.9, 0.1, 0.3, 1.0), emission=(0.25, 3.0, 0.5))
    for x, material in ((-0.9, tin), (0.9, glow)):
        scene.root.attach_new_node(geom_node(material.name, ball(0.5, 2), material)).set_pos(x, 0.5, -0.3)
    positions = np.random.default_rng(3).uniform((-2, -1, -1), (2, 1, 1), (5, 3))
    scene.root.attach_new_node(PointLights("lights", positions, (0.3, 0.2, 0.1), 2.0))
    scene.root.find("**/sun").node().set_shadow_caster(True, 32)
    if orthographic:
        scene.camera.node().lens = OrthographicLens(film_height=4.0, near=0.1, far=100.0)
    return scene


def texels(renderer, plan, target):
    """The bytes of a target of the plan that was drawn last, first row at the bottom."""
    with renderer._device:
        return renderer._gpu.images.texture(plan, target).read()


class Plain:
    """The slow definition: a pixel's numbers out of the texels of its targets, one at a time."""

    def __init__(self, renderer, plan):
        self.plan, self.lens = plan, plan.view.lens
        self._renderer, self._texels = renderer, {}

    def numbers(self, target, x, y):
        """A texel as it is stored, y from the top."""
        if target not in self._texels:
            self._texels[target] = self.stored(target).tolist()
        rows = self._texels[target]
        return rows[len(rows) - 1 - y][x]

    def stored(self, target):
        """A target's numbers, shape (height, width, components), first row at the bottom."""
        form = FORMATS[self.plan.target(target).format]
        width, height = self.plan.target_size(target)
        numbers = np.frombuffer(texels(self._renderer, self.plan, target), NUMBERS[form.dtype])
        return numbers.reshape(height, width, form.components)

    def floats(self, target, x, y):
        """A texel as shaders read it."""
        form = FORMATS[self.plan.target(target).format]
        values = [number / ONE.get(form.dtype, 1.0) for number in self.numbers(target, x, y)]
        if form.name == "rgb10_a2":
            values = [round(value * 1023.0) / 1023.0 for value in values]
        if form.srgb:
            linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in values[:3]]
            values = linear + values[3:]
        return [max(value, -1.0) for value in values] if form.dtype == "ni2" else values

    def pixel(self, name, x, y):
        return getattr(self, name)(x, y)

    def color(self, x, y):
        return self.numbers("color", x, y)[:3]

    def color_alpha(self, x, y):
        return self.numbers("color_alpha", x, y)

    def radiance(self, x, y):
        return self.numbers("final_radiance", x, y)[:3]

    def volumes(self, x, y):
        return self.numbers("volumes", x, y)[:3]

    def wireframe(self, x, y):
        return self.numbers("wireframe", x, y)[:3]

    def overdraw(self, x, y):
        return self.numbers("overdraw", x, y)

    def emission(self, x, y):
        return self.numbers("emission", x, y)[:3]

    def light(self, x, y):
        return self.numbers("light", x, y)[:3] if self.covered(x, y) else [0.0] * 3

    def id(self, x, y):
        return [self.numbers("id", x, y)[0] - 1]

    def visibility(self, x, y):
        instance, triangle = self.numbers("visibility", x, y)
        return [instance - 1, triangle % 2**31] if instance else [-1, -1]

    def albedo(self, x, y):
        packing = self.plan.target("albedo").encoding
        if packing == "sqrt10":
            (word,) = self.numbers("albedo", x, y)
            return [((word >> shift) % 1024 / 1023.0) ** 2 for shift in (0, 10, 20)]
        values = self.floats("albedo", x, y)[:3]
        return [value**2 for value in values] if packing == "sqrt8" else values

    def specular(self, x, y):
        return [root**2 for root in self.floats("specular", x, y)[:3]]

    def shininess(self, x, y):
        return [math.expm1(self.floats("specular", x, y)[3] * 20.0 * math.log(2.0))]

    def metallic(self, x, y):
        code = self.numbers("metallic_roughness", x, y)[0]
        return [(code - 1) / 65534 if code else 0.0]

    def roughness(self, x, y):
        code, roughness = self.numbers("metallic_roughness", x, y)
        return [roughness / 65535 if code else 0.0]

    def covered(self, x, y):
        if self.plan.target("albedo").encoding == "sqrt10":
            return self.numbers("albedo", x, y)[0] != 0
        return self.floats("albedo", x, y)[3] > 0

    def normal(self, x, y):
        if not self.covered(x, y):
            return [0.0] * 3
        packing = self.plan.target("normal").encoding
        stored = self.floats("normal", x, y)
        if packing in ("oct16", "oct8"):
            a, b = stored[:2] if packing == "oct16" else (v * (255.0 / 127.0) - 1.0 for v in stored[:2])
            up = 1.0 - (abs(a) + abs(b))
            if up < 0.0:
                folded = (1.0 - abs(b)) * (1 if a >= 0 else -1), (1.0 - abs(a)) * (1 if b >= 0 else -1)
            n = [*(folded if up < 0.0 else (a, b)), up]
        else:
            n = [v * 2.0 - 1.0 if packing == "unorm" else v for v in stored[:3]]
        length = max(math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), 1e-30)
        return [v / length for v in n]

    def depth(self, x, y):
        if not self.covered(x, y):
            return [math.inf]
        if self.plan.target("distance") is not None:
            return self.numbers("distance", x, y)
        if self.plan.target("position") is not None:
            return [self.numbers("position", x, y)[1]]
        return [float(self.lens.distance_from_depth(self.numbers("depth", x, y)[0]))]

    def position(self, x, y):
        if not self.covered(x, y):
            return [math.nan] * 3
        if self.plan.target("position") is not None:
            return self.numbers("position", x, y)[:3]
        width, height = self.plan.size
        ndc = (x + 0.5) / (width / 2) - 1.0, 1.0 - (y + 0.5) / (height / 2)
        return self.lens.view_from_distance(*ndc, self.depth(x, y)[0]).tolist()

    def normal_world(self, x, y):
        return self.to_world(self.normal(x, y), 0.0)

    def position_world(self, x, y):
        return self.to_world(self.position(x, y), 1.0)

    def to_world(self, place, moved):
        """By sums, and no matrix product, whose last digit depends on the processor."""
        (a, b, c), rows = place, self.plan.view.view_to_world.tolist()
        return [a * rows[0][k] + b * rows[1][k] + c * rows[2][k] + moved * rows[3][k] for k in range(3)]

    def image(self, name, shape):
        if name.endswith("atlas"):  # too many pixels to be gone through one at a time
            form = FORMATS[self.plan.target(name).format]
            stored = self.stored(name)[..., :3] / ONE.get(form.dtype, 1.0)
            return np.broadcast_to(stored[::-1].reshape((*shape[:2], -1)[: len(shape)]), shape).astype(
                np.float32
            )
        pixels = [[self.pixel(name, x, y) for x in range(shape[1])] for y in range(shape[0])]
        return np.array(pixels).reshape(shape).astype(OUTPUTS[name].dtype)


def check(renderer, scene, outputs):
    """Every output of a frame, alone and with another one under way, against its definition."""
    plan = renderer.plan(scene, 0.0, outputs)
    (ahead,) = renderer.render_many(scene, (0.0,), outputs)
    frame = renderer.draw(plan)
    plain = Plain(renderer, plan)
    for name in outputs:
        info, image = OUTPUTS[name], frame[name]
        size = plan.target_size(name) if name.endswith("atlas") else renderer.size
        assert image.shape == (*size[::-1], info.channels)[: 2 + (info.channels > 1)], name
        assert image.dtype == info.dtype, name
        assert image.flags.c_contiguous, name
        assert image.flags.writeable, name
        assert ahead[name].tobytes() == image.tobytes(), name
        assert image.tobytes() == plain.image(name, image.shape).tobytes(), name
    return frame


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_every_output_is_what_its_texels_say(settings):
    """13 and 5 pixels of three bytes, or of six, end at no multiple of four: rows are not padded."""
    scene = every_kind_of_thing(orthographic=settings is NARROW)
    # the settings are formats of surfaces; shaders of light take long to compile
    everything = tuple(name for name in OUTPUTS if name not in METALLIC)
    outputs = everything if settings == Settings() else SURFACES
    with make_renderer((13, 7), settings) as renderer:
        frame = check(renderer, scene, outputs)
        for name in outputs:
            assert len(np.unique(frame[name].reshape(-1, OUTPUTS[name].channels), axis=0)) > 1, name
        for size in ((1, 1), (1, 5), (5, 1)):
            renderer.resize(size)
            check(renderer, scene, outputs)


@pytest.mark.parametrize(
    ("form", "method"), [("unorm8", "blend"), ("float16", "optical_depth"), ("float32", "optical_depth")]
)
def test_the_slices_of_shadow_are_what_their_texels_say(form, method):
    with make_renderer((13, 7), Settings(particle_shadow_format=form, particle_shadows=method)) as renderer:
        for tint in (0.0, 0.5):
            scene = cloud_scene(puff(40), ground=False, tint=tint)
            assert check(renderer, scene, ("particle_shadow_atlas",)).particle_shadow_atlas.any()


def test_metallic_and_roughness_are_what_their_texels_say():
    """Beside a surface of the other model, which has neither."""
    scene = wall_scene(material=Material("steel", (0.6, 0.6, 0.7, 1.0), metallic=0.9, roughness=0.3))
    tin = Material("tin", (0.2, 0.3, 0.5, 1.0), specular=(0.5, 0.4, 0.3), shininess=20.0)
    scene.root.attach_new_node(geom_node("tin", ball(0.5, 2), tin)).set_pos(0, 4, 0)
    with make_renderer((13, 7)) as renderer:
        frame = check(renderer, scene, METALLIC)
    assert np.unique(frame["metallic"]) == pytest.approx([0.0, 0.9], abs=1e-5)
    assert np.unique(frame["roughness"]) == pytest.approx([0.0, 0.3], abs=1e-5)


def test_an_averaged_picture_is_what_its_texels_say():
    with make_renderer((13, 7), Settings(supersample=2)) as renderer:
        check(renderer, wall_scene(), ("color", "radiance"))


def test_an_image_does_not_depend_on_how_many_rows_are_decoded_at_a_time(monkeypatch):
    with make_renderer((31, 17)) as renderer:
        plan = renderer.plan(every_kind_of_thing(), 0.0, SURFACES)
        whole = renderer.draw(plan)
        for pixels in (1, 62, 31 * 16):
            monkeypatch.setattr(readback, "_BAND", pixels)
            bands = renderer.draw(plan)
            for name in SURFACES:
                assert bands[name].tobytes() == whole[name].tobytes(), (name, pixels)


@pytest.mark.parametrize("name", ["normal_world", "position_world", "albedo", "visibility", "shininess"])
def test_decoding_takes_the_same_memory_whatever_the_pictures_height(name):
    """Beside the image and its targets, which grow with it."""
    spent = []
    with make_renderer((256, 512)) as renderer:
        for height in (512, 2048):
            renderer.resize((256, height))
            plan = renderer.plan(wall_scene(), 0.0, (name,))
            frame = renderer.draw(plan)
            targets = {target: texels(renderer, plan, target) for target in readback.targets_read(plan)}
            tracemalloc.start()
            readback.read_images(plan, targets.__getitem__)
            spent.append(tracemalloc.get_traced_memory()[1] - frame[name].nbytes)
            tracemalloc.stop()
    assert spent[1] < 1.1 * spent[0]


def test_an_empty_scene_has_every_output():
    invalid = {
        "depth": math.inf,
        "position": math.nan,
        "position_world": math.nan,
        "id": -1,
        "visibility": -1,
    }
    with make_renderer((13, 7)) as renderer:
        frame = renderer.render(Scene(), 0.0, tuple(OUTPUTS))
    for name, info in OUTPUTS.items():
        shape = (0, 0) if name.endswith("atlas") else (7, 13)
        assert frame[name].shape == (shape if info.channels == 1 else (*shape, info.channels)), name
        assert frame[name].flags.writeable, name
        expected = np.full_like(frame[name], invalid.get(name, 0))
        np.testing.assert_array_equal(frame[name], expected, err_msg=name)
