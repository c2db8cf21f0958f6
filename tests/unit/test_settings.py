"""Settings are declared once, and checked when they are made."""

import inspect
import json

import numpy as np
import pytest

from firefly_sample.errors import SettingsError
from firefly_sample.settings import NOT_FORWARD, SETTINGS, Settings


@pytest.mark.parametrize(
    "wrong",
    [
        {"look": "modern"},
        {"position_method": "depth8"},
        {"light_method": "tiles"},
        {"supersample": 3},
        {"supersample": 2.0},
        {"supersample": True},
        {"volume_depth_test": 1},
        {"tone": "aces"},
        {"exposure": 0.0},
        {"exposure": -1},
        {"exposure": float("nan")},
        {"exposure": 1e300},
        {"exposure": "bright"},
        {"exposure": "AUTO"},
        {"exposure": None},
        {"look": "classic", "exposure": 2.0},
        {"look": "classic", "exposure": "auto"},
        {"look": "classic", "tone": "exponential"},
        {"look": "classic", "clamp_light": True},
        {"look": "classic", "light_method": "loop"},
        {"look": "classic", "light_method": "clustered"},
        {"look": "classic", "light_method": "forward"},
        {"look": "pyrender", "tone": "exponential"},
        {"look": "flat", "tone": "exponential"},
        {"look": "flat", "exposure": 2.0},
        {"look": "flat", "albedo_format": "rgba32f"},
        {"look": "flat", "light_method": "forward"},
    ],
    ids=str,
)
def test_a_wrong_value_is_refused_by_name(wrong):
    with pytest.raises(SettingsError, match=f"'{list(wrong)[-1]}'"):
        Settings(**wrong)


def test_a_setting_that_does_not_exist_lists_those_that_do():
    with pytest.raises(SettingsError, match="no setting 'gamma': there are look, position_method"):
        Settings().with_changes(gamma=2.2)


def test_the_look_brings_its_tone_curve():
    assert Settings().tone_curve == "exponential"
    assert {Settings(look=look).tone_curve for look in ("classic", "pyrender", "flat", "panda3d")} == {"none"}
    assert Settings(tone="none").as_dict()["tone"] == "none"


def test_settings_are_plain_json_also_from_numpy_numbers():
    settings = Settings(exposure=np.float32(2.0))
    assert json.loads(json.dumps(settings.as_dict())) == settings.as_dict()
    assert settings == Settings(exposure=2)
    assert type(Settings(exposure=np.str_("auto")).exposure) is str


@pytest.mark.parametrize("setting", SETTINGS.values(), ids=SETTINGS)
def test_a_declared_setting_documents_checks_and_takes_its_values(setting):
    entry = Settings.__doc__.split(f"\n{setting.name} : ")[1]
    assert entry.startswith(f"{setting.expected}; default ")
    assert f"\n    {setting.help}\n" in entry
    assert setting.name in inspect.signature(Settings).parameters
    assert getattr(Settings(), setting.name) == setting.check(setting.default) == setting.default
    for value in setting.choices or setting.range:
        if setting.above and value == setting.range[0]:
            continue
        assert setting.check(value) == value
        assert type(setting.check(value)) is setting.type
    for word in setting.words:
        assert setting.check(word) == word
        assert setting.expected.endswith(f", or {word}")
    for wrong in ("nothing", object(), np.zeros(2), *(() if setting.choices else (-1, 1e31, True))):
        with pytest.raises(SettingsError) as caught:
            setting.check(wrong)
        assert str(caught.value).startswith(f"setting '{setting.name}' must be {setting.expected}; got ")


def limits():
    """Each limit, with the value of the other setting that it is about, and a value that breaks it."""
    for setting in SETTINGS.values():
        for limit in setting.limits:
            values = setting.choices or (setting.range[1],)
            yield from ((setting, limit, value) for value in values if value not in limit.allowed)


@pytest.mark.parametrize(("setting", "limit", "value"), list(limits()))
def test_what_contradicts_is_an_error_that_names_both_and_the_reason(setting, limit, value):
    for other in limit.values:
        with pytest.raises(SettingsError) as caught:
            Settings(**{limit.other: other, setting.name: value})
        assert str(caught.value).startswith(f"setting {setting.name!r} must be ")
        assert f" with {limit.other}={other}, which {limit.because}; got {value!r}: change " in str(
            caught.value
        )
        for allowed in limit.allowed:
            Settings(**{limit.other: other, setting.name: allowed})


def test_forward_shading_rules_out_what_needs_a_g_buffer():
    assert NOT_FORWARD == {"interpolation": "rasterizer", "light_resolution": "full"}


def test_a_preset_gives_way_to_what_it_contradicts():
    for name in ("fast", "accurate"):
        assert Settings.preset(name, look="classic").look == "classic"
        assert Settings.preset(name, light_method="forward").interpolation == "rasterizer"
    assert Settings.preset("fast", cutoff_budget=1e-3).cutoff_threshold is None
