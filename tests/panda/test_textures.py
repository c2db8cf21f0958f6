"""Images and samplers of textures: Panda3D's pictures of them show our pixels; what is lacking is named."""

from __future__ import annotations

import numpy as np
import pytest
from panda3d import core

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.states import StateReader
from firefly_sample.model.panda3d.texels import read_texels
from firefly_sample.model.panda3d.textures import TextureReader, read_sampler
from firefly_sample.srgb import srgb_to_linear
from tests.panda.cards import PIXELS, cut_out, quad, size_of, wall

TEXTURE, SAMPLER, STAGE = core.Texture, core.SamplerState, core.TextureStage
TEXELS = 4
"""Width and height of the textures here: each texel is two pixels wide."""


def empty(form="rgba", component="unsigned_byte", size=(TEXELS, TEXELS)):
    made = TEXTURE(f"{form} {component}")
    made.setup_2d_texture(*size, getattr(TEXTURE, f"T_{component}"), getattr(TEXTURE, f"F_{form}"))
    made.set_minfilter(SAMPLER.FT_nearest)
    made.set_magfilter(SAMPLER.FT_nearest)
    return made


def filled(form="rgba", component="unsigned_byte", seed=0):
    """A texture of random numbers: whole numbers of any size, or shares."""
    made = empty(form, component)
    numbers = np.random.default_rng(seed)
    count = TEXELS * TEXELS * made.get_num_components()
    if component in ("float", "half_float"):
        values = numbers.uniform(0, 1, count).astype("f4" if component == "float" else "f2")
    else:
        values = np.frombuffer(numbers.bytes(count * made.get_component_width()), dtype=np.uint8)
    made.set_ram_image(values.tobytes())
    return made


BYTES = (
    *("alpha", "luminance", "luminance_alpha", "luminance_alphamask", "red", "rg", "rgb", "rgba"),
    *("rgb332", "rgb5", "rgba4", "rgba5", "rgb8", "rgba8", "rgb10_a2", "rgb12", "rgba12", "rgb16", "rgba16"),
    *("r16", "rg16", "r32", "rg32", "rgb32", "rgba32", "rgbm", "rgb9_e5", "depth_component"),
    *("blue", "green", "rgba8i", "sluminance", "sluminance_alpha", "srgb", "srgb_alpha"),
)
WIDER = {
    "unsigned_short": ("luminance", "rgb", "rgba16"),
    "unsigned_int": ("rgba32",),
    "byte": ("rgba",),
    "short": ("rgba16",),
    "half_float": ("rgb16", "rgba16"),
    "float": ("r32", "rgb32", "rgba32"),
}


def cleared():
    made = empty("rgba")
    made.set_clear_color((1, 0.5, 0.25, 0.1))
    return made


def one_dimensional():
    made = TEXTURE("row")
    made.setup_1d_texture(TEXELS, TEXTURE.T_unsigned_byte, TEXTURE.F_rgb)
    made.set_ram_image(bytes(range(0, 240, 20)))
    made.set_minfilter(SAMPLER.FT_nearest)
    made.set_magfilter(SAMPLER.FT_nearest)
    return made


MADE = {
    **{form: lambda form=form: filled(form) for form in BYTES},
    **{
        f"{form} {component}": lambda form=form, component=component: filled(form, component)
        for component, forms in WIDER.items()
        for form in forms
    },
    "cleared": cleared,
    "no image": empty,
}


def textured(made):
    return lambda card: card.set_texture(made())


def shown():
    """A wall of cards with these textures."""
    return wall({name: textured(made) for name, made in MADE.items()}, False, False)


def test_every_format_is_sampled_as_panda3d_samples_it(by_panda):
    picture = by_panda(shown, size=size_of(MADE)).color
    wrong = {}
    for index, (name, made) in enumerate(MADE.items()):
        codes = read_texels(made(), "modulate", lambda loss: None)
        codes = np.kron(np.broadcast_to(codes, (TEXELS, TEXELS, 4)), np.ones((2, 2, 1)))
        if "srgb" in name or "sluminance" in name:
            codes[..., :3] = 255 * srgb_to_linear(codes[..., :3] / 255)
        difference = np.abs(cut_out(picture, index) - codes).max()
        if difference > 1:
            wrong[name] = difference
    assert not wrong
    assert PIXELS == 2 * TEXELS


# --- uses ---


def pixel(made, kind="modulate"):
    losses = Losses()
    codes = read_texels(made, kind, losses.add)
    return codes[0, 0].tolist(), losses.lines()


def one(form, *stored, component="unsigned_byte"):
    made = empty(form, component, (1, 1))
    made.set_ram_image(np.array(stored, dtype={"unsigned_byte": "u1", "float": "f4"}[component]).tobytes())
    return made


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("modulate", [3, 2, 1, 200]),
        ("sampled", [3, 2, 1, 200]),
        ("opaque", [3, 2, 1, 255]),
        ("glow", [145, 145, 145, 255]),
    ],
)
def test_each_use_takes_its_channels(kind, expected):
    assert pixel(one("rgba", 1, 2, 3, 200), kind) == (expected, [])


def test_alpha_alone_multiplies_alpha_and_is_black_where_it_replaces():
    assert pixel(one("alpha", 80))[0] == [255, 255, 255, 80]
    assert pixel(one("alpha", 80), "sampled")[0] == [0, 0, 0, 80]


def test_the_first_row_is_on_top():
    made = empty("luminance", size=(1, 2))
    made.set_ram_image(bytes((10, 20)))
    assert read_texels(made, "modulate", lambda loss: None)[:, 0, 0].tolist() == [20, 10]


@pytest.mark.parametrize("number", [1.5, -0.25, np.nan, np.inf])
def test_floats_outside_a_code_are_cut_off_by_name(number):
    losses = ["numbers of textures outside 0..1 are cut off"]
    shown = 255 if number > 1 else 0
    assert pixel(one("r32", number, component="float")) == ([shown, 0, 0, 255], losses)


def of_type(setup, *sizes):
    made = TEXTURE("other")
    getattr(made, f"setup_{setup}")(*sizes, TEXTURE.T_unsigned_byte, TEXTURE.F_rgb)
    return made


@pytest.mark.parametrize(
    ("made", "loss"),
    [
        (lambda: of_type("3d_texture", 2, 2, 2), "textures of the type 3d_texture are drawn black"),
        (lambda: of_type("cube_map", 2), "textures of the type cube_map are drawn black"),
        (
            lambda: of_type("2d_texture_array", 2, 2, 2),
            "textures of the type 2d_texture_array are drawn black",
        ),
        (lambda: filled("rgba8i"), "textures of the format rgba8i are drawn black"),
        (
            lambda: filled("depth_stencil", "unsigned_int_24_8"),
            "textures of the format depth_stencil are drawn",
        ),
        (lambda: TEXTURE("none"), "textures without an image are drawn black"),
        (lambda: core.MovieTexture("film"), "videos stand still"),
    ],
)
def test_what_has_no_image_of_codes_is_black_by_name(made, loss):
    codes, lines = pixel(made())
    assert codes[:3] == [0, 0, 0]
    assert lines[0].startswith(loss)


def test_a_compressed_image_is_decoded_by_panda3d():
    made = filled("rgba")
    assert made.compress_ram_image(TEXTURE.CM_dxt5)
    decoded = made.make_copy()
    assert decoded.uncompress_ram_image()
    codes = np.frombuffer(decoded.get_ram_image_as("RGBA"), dtype=np.uint8).reshape(TEXELS, TEXELS, 4)
    assert np.array_equal(read_texels(made, "modulate", lambda loss: None), codes[::-1])


def test_colours_of_few_bits_as_floats_are_named():
    losses = ["textures of the format r11g11b10 have 8 bits for each colour"]
    assert pixel(one("r11_g11_b10", 1, 2, 3)) == ([3, 2, 1, 255], losses)


def test_codes_of_srgb_textures_are_kept_by_name():
    losses = ['the codes of sRGB textures are decoded only by look="correct"']
    assert pixel(one("srgb", 10, 20, 30)) == ([30, 20, 10, 255], losses)


def test_mipmaps_of_its_own_are_made_anew_by_name():
    made = filled("rgb")
    made.generate_ram_mipmap_images()
    assert pixel(made)[1] == ["smaller copies (mipmaps) that a texture brings are made anew"]


def test_an_image_that_is_not_loaded_yet_is_loaded(tmp_path):
    made = filled("rgb")
    file = core.Filename.from_os_specific(str(tmp_path / "image.png"))
    assert made.write(file)
    loaded = TEXTURE("loaded")
    assert loaded.read(file)
    loaded.clear_ram_image()
    assert not loaded.has_ram_image()
    expected = read_texels(made, "modulate", lambda loss: None)
    assert np.array_equal(read_texels(loaded, "modulate", lambda loss: None), expected)


# --- samplers ---


def sampled(**settings):
    made = SAMPLER()
    for name, setting in settings.items():
        getattr(made, f"set_{name}")(setting)
    losses = Losses()
    return read_sampler(made, "texture", losses), losses.lines()


@pytest.mark.parametrize(
    ("theirs", "ours"),
    [("clamp", "clamp"), ("repeat", "repeat"), ("mirror", "mirror"), ("invalid", "repeat")],
)
def test_wrap_modes_are_panda3ds(theirs, ours):
    found, lines = sampled(wrap_u=getattr(SAMPLER, f"WM_{theirs}"), wrap_v=SAMPLER.WM_clamp)
    assert (found["wrap_u"], found["wrap_v"], lines) == (ours, "clamp", [])


@pytest.mark.parametrize(
    "name",
    [
        *("nearest", "linear", "nearest_mipmap_nearest", "linear_mipmap_nearest"),
        *("nearest_mipmap_linear", "linear_mipmap_linear"),
    ],
)
def test_filters_are_panda3ds(name):
    found, lines = sampled(minfilter=getattr(SAMPLER, f"FT_{name}"), magfilter=SAMPLER.FT_nearest)
    assert (found["minfilter"], found["magfilter"], lines) == (name, "nearest", [])


def test_default_filters_are_those_of_panda3ds_configuration():
    page = core.load_prc_file_data(
        "test", "texture-minfilter nearest_mipmap_linear\ntexture-magfilter nearest"
    )
    try:
        found = sampled()[0]
    finally:
        core.unload_prc_file(page)
    assert (found["minfilter"], found["magfilter"]) == ("nearest_mipmap_linear", "nearest")
    assert sampled()[0]["minfilter"] == "linear"


@pytest.mark.parametrize(
    ("settings", "loss"),
    [
        ({"wrap_u": SAMPLER.WM_border_color}, "the wrap mode border_color of textures is drawn as clamp"),
        ({"wrap_v": SAMPLER.WM_mirror_once}, "the wrap mode mirror_once of textures is drawn as mirror"),
        ({"anisotropic_degree": 8}, "anisotropic filters of textures are not followed"),
        ({"minfilter": SAMPLER.FT_shadow}, "textures that compare depths are drawn as plain ones"),
        (
            {"minfilter": SAMPLER.FT_linear_mipmap_linear, "lod_bias": 1.5},
            "biases and limits of textures' levels of detail are not followed",
        ),
        (
            {"minfilter": SAMPLER.FT_linear_mipmap_linear, "max_lod": 2},
            "biases and limits of textures' levels of detail are not followed",
        ),
    ],
)
def test_what_a_sampler_lacks_is_named(settings, loss):
    assert sampled(**settings)[1] == [f"{loss}: 'texture'"]


# --- what changes ---


def test_a_texture_is_read_once_for_each_sampler_and_use():
    reader, made = TextureReader(Losses()), filled("rgba")
    default, other = made.get_default_sampler(), SAMPLER(made.get_default_sampler())
    other.set_wrap_u(SAMPLER.WM_mirror)
    first = reader.read(made, default, "modulate").texture
    assert reader.read(made, default, "modulate").texture is first
    assert reader.read(made, other, "modulate").texture is not first
    assert reader.read(made, default, "glow").texture is not first


def surface_of(reader, card):
    return reader.surface(card.get_net_state(), False, False, "card")


def test_a_changed_image_is_replaced_in_place():
    reader, card, made = StateReader(Losses()), quad("card", False), filled("rgb")
    card.set_texture(made)
    surface = surface_of(reader, card)
    texture, revision = surface.material.texture, surface.material.texture.revision
    assert surface_of(reader, card) is surface
    assert texture.revision == revision
    made.set_ram_image(bytes(range(3 * TEXELS * TEXELS)))
    assert surface_of(reader, card) is surface
    assert texture.pixels[-1, 0].tolist() == [2, 1, 0, 255]
    assert texture.revision == revision + 1
    memoryview(made.modify_ram_image())[0] = 77
    assert surface_of(reader, card) is surface
    assert texture.pixels[-1, 0].tolist() == [2, 1, 77, 255]


def test_a_changed_image_is_seen_by_all_surfaces_with_it():
    reader, made = StateReader(Losses()), filled("rgb")
    cards = [quad("one", False), quad("two", False)]
    for card in cards:
        card.set_texture(made)
    cards[1].set_depth_offset(1)
    before = [surface_of(reader, card) for card in cards]
    made.set_ram_image(bytes(3 * TEXELS * TEXELS))
    assert [surface_of(reader, card) for card in cards] == before
    assert not before[1].material.texture.pixels[..., :3].any()


def test_another_size_or_wrap_mode_is_followed():
    reader, card, made = StateReader(Losses()), quad("card", False), filled("rgb")
    card.set_texture(made)
    surface_of(reader, card)
    made.setup_2d_texture(1, 1, TEXTURE.T_unsigned_byte, TEXTURE.F_rgb)
    made.set_ram_image(bytes((1, 2, 3)))
    assert surface_of(reader, card).material.texture.pixels.tolist() == [[[3, 2, 1, 255]]]
    made.set_wrap_u(SAMPLER.WM_clamp)
    assert surface_of(reader, card).material.texture.wrap_u == "clamp"


def test_a_sampler_of_the_state_counts_before_the_textures():
    card, sampler = quad("card", False), SAMPLER()
    sampler.set_wrap_v(SAMPLER.WM_mirror)
    card.set_texture(STAGE("stage"), filled("rgb"), sampler)
    assert surface_of(StateReader(Losses()), card).material.texture.wrap_v == "mirror"
