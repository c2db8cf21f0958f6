"""The output color_alpha, drawn over any background, is the picture before that background."""

from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from firefly_sample import Settings, composite
from firefly_sample.errors import OutputError
from firefly_sample.lab.reference.shading import tone_curve
from firefly_sample.scene.lights import AmbientLight, PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear
from tests.clouds import ball_of
from tests.conftest import borrow_renderer
from tests.scenes import ball_scene, geom_node, wall

SIZE = 64, 48
OUTPUTS = ("color", "color_alpha", "radiance")
BACKGROUNDS = {
    "black": (0.0, 0.0, 0.0),
    "grey": (0.2, 0.2, 0.2),
    "white": (1.0, 1.0, 1.0),
    "red": (0.9, 0.05, 0.3),
}
TONES = ("exponential", "none")


def balls():
    """Three opaque balls before nothing; their light is below white."""
    scene = ball_scene(0)
    scene.root.find("floor").detach_node()
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.15, 0.2)))
    lamp = PointLight("lamp", (0.6, 0.5, 0.4), 30.0)
    scene.root.attach_new_node(lamp).set_pos(-4, 2, 5)
    return scene


def panes():
    """Before the balls, panes of which each hides another share."""
    scene = balls()
    for index, (x, y, alpha) in enumerate([(-1, 4, 0.3), (0, 5, 0.6), (1, 6.5, 0.95), (1.5, 3, 0.05)]):
        color = 0.9 - 0.2 * index, 0.2 + 0.2 * index, 0.5, alpha
        pane = Material(f"pane {index}", color, alpha_mode="blend", double_sided=True)
        scene.root.attach_new_node(geom_node(pane.name, wall(2.5), pane)).set_pos(x, y, 0.5)
    return scene


def cloud(scene=None):
    """Particles of all opacities around the balls."""
    scene = balls() if scene is None else scene
    alphas = np.random.default_rng(1).uniform(0.05, 0.9, 200)
    node = ParticleNode("puff", 2 * ball_of(200), 0.4, alphas, (0.6, 0.4, 0.3))
    scene.root.attach_new_node(node).set_pos(0, 8, 1)
    return scene


def dots(scene=None):
    """Light that covers nothing, before the balls and beside them."""
    scene = balls() if scene is None else scene
    rng = np.random.default_rng(1)
    places, colors = rng.uniform((-5, 3, -2), (5, 12, 4), (40, 3)), rng.uniform(0.1, 4, (40, 3))
    scene.root.attach_new_node(Sprites("dots", places, colors, 0.3))
    return scene


SCENES = {
    "balls": (balls, "sorted"),
    "panes": (panes, "sorted"),
    "panes exact": (panes, "exact"),
    "panes weighted": (panes, "weighted"),
    "cloud": (cloud, "sorted"),
    "dots": (dots, "sorted"),
    "everything": (lambda: dots(cloud(panes())), "sorted"),
}


# --- The definition ---


@pytest.mark.parametrize("supersample", [1, 2])
@pytest.mark.parametrize("name", SCENES)
def test_alpha_is_the_hidden_share_and_the_color_is_the_light_over_it(name, supersample):
    """Two pictures of radiance show both: before black, the light; before white, also the share."""
    make, transparency = SCENES[name]
    scene = make()
    for tone in TONES:
        settings = Settings(tone=tone, supersample=supersample, transparency=transparency, exposure=1.5)
        with borrow_renderer(SIZE, settings) as renderer:
            scene.background = (1.0, 1.0, 1.0)
            white = renderer.render(scene, outputs=("radiance",)).radiance.astype(np.float64)
            scene.background = (0.0, 0.0, 0.0)
            frame = renderer.render(scene, outputs=OUTPUTS)
        light = 1.5 * frame.radiance.astype(np.float64)
        hidden = 1.0 - (white - frame.radiance).mean(axis=-1)
        brightest = srgb_to_linear(254.5 / 255.0)
        brightest = brightest if tone == "none" else -np.log1p(-brightest)
        raised = np.minimum(light.max(axis=-1) / brightest, 1.0)
        alpha = frame.color_alpha[..., 3].astype(np.float64)
        # rounded where a share is hidden, and up where light is too bright for it
        assert (np.abs(alpha - 255 * hidden)[raised < hidden] <= 1.0).all()
        assert (alpha >= 255 * np.maximum(hidden, raised) - 0.51).all()
        assert (alpha <= 255 * np.maximum(hidden, raised) + 1.0).all()
        shown = alpha > 0
        straight = light[shown] / (alpha[shown, None] / 255.0)
        expected = 255.0 * linear_to_srgb(tone_curve(straight, tone))
        assert np.abs(frame.color_alpha[shown][:, :3] - expected).max() <= 0.5 + 2e-2
        assert (frame.color_alpha[~shown] == 0).all()
        assert 0.03 < shown.mean() < 1.0


# --- Over backgrounds ---


@pytest.mark.parametrize("tone", TONES)
def test_an_opaque_scene_over_a_background_is_the_picture_itself(tone):
    """Also by any other program's formula: alpha is 0 or 255, and no two things are mixed."""
    scene = balls()
    with borrow_renderer(SIZE, Settings(tone=tone)) as renderer:
        for background in BACKGROUNDS.values():
            scene.background = background
            frame = renderer.render(scene, outputs=OUTPUTS)
            assert set(np.unique(frame.color_alpha[..., 3])) == {0, 255}
            assert (composite(frame.color_alpha, background, tone) == frame.color).all()
            behind = np.broadcast_to(frame.color[0, 0], frame.color.shape)
            assert (composite(frame.color_alpha, behind, tone) == frame.color).all()
            over = Image.new("RGBA", SIZE, tuple(map(int, frame.color[0, 0])))
            over.alpha_composite(Image.fromarray(frame.color_alpha))
            assert (np.asarray(over)[..., :3] == frame.color).all()


def test_a_gradient_is_a_background_too():
    scene = balls()
    scene.background = VerticalGradient((0.3, 0.2, 0.1), (0.0, 0.1, 0.6))
    empty = Scene(background=scene.background)
    empty.camera.set_mat(scene.camera.get_mat())
    empty.camera.node().lens = scene.lens
    with borrow_renderer(SIZE) as renderer:
        frame = renderer.render(scene, outputs=OUTPUTS)
        behind = renderer.render(empty).color
    assert len(np.unique(behind)) > 20
    assert (composite(frame.color_alpha, behind) == frame.color).all()


def interval(color_alpha, background, tone):
    """The least and the largest codes that fit colours and alphas which were rounded to these."""
    codes, alpha = color_alpha[..., :3].astype(np.float64), color_alpha[..., 3:] / 255.0

    def radiance(code):
        linear = srgb_to_linear(np.clip(code, 0.0, 254.5) / 255.0)
        return linear if tone == "none" else -np.log1p(-linear)

    found = []
    for half in (-0.5, 0.5):
        light = radiance(codes + half) * alpha
        for share in (alpha - 0.5 / 255, alpha + 0.5 / 255):
            mixed = light + np.array(background) * (1.0 - np.clip(share, 0.0, 1.0))
            found.append(255.0 * linear_to_srgb(tone_curve(mixed, tone)))
    return np.min(found, axis=0), np.max(found, axis=0)


@pytest.mark.parametrize("supersample", [1, 2])
@pytest.mark.parametrize("name", [name for name in SCENES if name not in ("dots", "everything")])
def test_over_any_background_it_is_the_picture_to_one_code(name, supersample):
    """Eight bits of alpha before something bright may be a second code, in one pixel of a thousand."""
    make, transparency = SCENES[name]
    scene = make()
    for tone in TONES:
        settings = Settings(tone=tone, supersample=supersample, transparency=transparency)
        with borrow_renderer(SIZE, settings) as renderer:
            for background in BACKGROUNDS.values():
                scene.background = background
                frame = renderer.render(scene, outputs=OUTPUTS)
                shown = composite(frame.color_alpha, background, tone).astype(int)
                apart = np.abs(shown - frame.color).max(axis=-1)
                low, high = interval(frame.color_alpha, background, tone)
                fits = (frame.color >= low - 0.6) & (frame.color <= high + 0.6)
                assert fits[frame.color_alpha[..., 3] > 0].all()  # what has no alpha has no colour
                assert apart.max() <= 3
                assert (apart > 1).mean() <= 1e-3
                assert len(np.unique(frame.color_alpha[..., 3])) > 2 or (name, supersample) == ("balls", 1)


@pytest.mark.parametrize("tone", TONES)
def test_light_that_covers_nothing_is_there_over_black(tone):
    """Alpha cannot add light: beside what is opaque, dots hide a share of the background instead."""
    scene = dots()
    with borrow_renderer(SIZE, Settings(tone=tone)) as renderer:
        scene.background = (0.0, 0.0, 0.0)
        frame = renderer.render(scene, outputs=(*OUTPUTS, "id"))
        shown = composite(frame.color_alpha, (0.0, 0.0, 0.0), tone).astype(int)
        most = 1 if tone == "none" else 9  # the brightest codes of the curve are far apart in radiance
        assert np.abs(shown - frame.color).max() <= most
        scene.background = (0.2, 0.2, 0.2)
        grey = renderer.render(scene, outputs=OUTPUTS)
        assert (grey.color_alpha == frame.color_alpha).all()
        shown = composite(frame.color_alpha, (0.2, 0.2, 0.2), tone).astype(int)
        before_balls = frame.id >= 0
        assert (shown == grey.color)[before_balls].all()
        assert (shown - grey.color <= most).all()


@pytest.mark.parametrize("method", ["volumes", "clustered", "forward"])
def test_every_light_method_has_it(render, method):
    settings = Settings(light_method=method, supersample=2)
    frame = render(panes(), settings, SIZE, ("color", "color_alpha"))
    other = render(panes(), Settings(supersample=2), SIZE, ("color", "color_alpha"))
    assert np.abs(frame.color_alpha.astype(int) - other.color_alpha).max() <= 1


def test_it_does_not_depend_on_the_background_nor_on_other_outputs(render):
    scene = panes()
    alone = render(scene, None, SIZE, ("color_alpha",)).color_alpha
    scene.background = (0.3, 0.6, 0.9)
    assert (render(scene, None, SIZE, OUTPUTS).color_alpha == alone).all()


def test_without_anything_it_is_empty(render):
    assert not render(Scene(background=(1.0, 1.0, 1.0)), None, SIZE, ("color_alpha",)).color_alpha.any()


# --- The function ---

code = st.integers(0, 255)


@given(st.tuples(code, code, code), code, st.tuples(code, code, code), st.sampled_from(TONES))
def test_compositing_is_over_in_linear_light(color, alpha, behind, tone):
    image = np.array([[[*color, alpha]]], dtype=np.uint8)
    (((*got,),),) = composite(image, np.array(behind, dtype=np.uint8), tone).tolist()
    if alpha in (0, 255):
        assert got == list(color if alpha else behind)
    for one, over, under in zip(got, color, behind, strict=True):
        assert min(over, under) - 1 <= one <= max(over, under) + 1
        if tone == "none":
            share = alpha / 255
            exact = srgb_to_linear(over / 255) * share + srgb_to_linear(under / 255) * (1 - share)
            assert abs(one - 255 * linear_to_srgb(exact)) <= 0.5 + 1e-9
        if over == under < 255:
            assert one == over


def test_a_background_may_be_brighter_than_white():
    image = np.array([[[0, 0, 0, 128]]], dtype=np.uint8)
    assert composite(image, (100.0, 5.0, 0.5)).tolist()[0][0][0] == 255
    assert composite(image, (np.inf, 0.0, 0.0)).tolist() == [[[255, 0, 0]]]
    assert composite(np.array([[[9, 8, 7, 255]]], np.uint8), (np.inf, 0.0, 0.0)).tolist() == [[[9, 8, 7]]]


@pytest.mark.parametrize(
    ("image", "background", "tone", "message"),
    [
        (np.zeros((2, 2, 3), np.uint8), (0, 0, 0), "none", r"color_alpha must be uint8 of shape \(..., 4\)"),
        (np.zeros((2, 2, 4)), (0, 0, 0), "none", "color_alpha must be uint8"),
        (np.zeros((2, 2, 4), np.uint8), (0, 0), "none", "one colour of 3 numbers, or of shape"),
        (np.zeros((2, 2, 4), np.uint8), np.zeros((3, 2, 3)), "none", "or of shape"),
        (np.zeros((2, 2, 4), np.uint8), (0, 0, 256), "none", "codes of 0 to 255"),
        (np.zeros((2, 2, 4), np.uint8), (0.0, 0.0, np.nan), "none", "radiance of 0 or more"),
        (np.zeros((2, 2, 4), np.uint8), ("a", "b", "c"), "none", "one colour of 3 numbers"),
        (np.zeros((2, 2, 4), np.uint8), (0, 0, 0), "exponentiel", "did you mean 'exponential'"),
    ],
)
def test_what_is_wrong_is_named(image, background, tone, message):
    with pytest.raises(OutputError, match=message):
        composite(image, background, tone)


def test_pillow_reads_it_back(render):
    """A PNG keeps straight alpha, and every code of it."""
    image = render(panes(), Settings(supersample=2), SIZE, ("color_alpha",)).color_alpha
    file = BytesIO()
    Image.fromarray(image).save(file, "PNG")
    assert (np.asarray(Image.open(file)) == image).all()
