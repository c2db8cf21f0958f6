"""Settings are checked when they are made."""

import json

import numpy as np
import pytest

from firefly_sample.errors import SettingsError
from firefly_sample.settings import Settings


@pytest.mark.parametrize(
    "wrong",
    [
        {"look": "modern"},
        {"position": "depth8"},
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
        {"look": "classic", "exposure": 2.0},
        {"look": "classic", "tone": "exponential"},
        {"look": "classic", "clamp_light": True},
        {"look": "classic", "light_method": "loop"},
        {"look": "classic", "light_method": "clustered"},
        {"look": "classic", "light_method": "forward"},
    ],
    ids=str,
)
def test_a_wrong_value_is_refused_by_name(wrong):
    with pytest.raises(SettingsError, match=f"'{list(wrong)[-1]}'"):
        Settings(**wrong)


def test_a_setting_that_does_not_exist_lists_those_that_do():
    with pytest.raises(SettingsError, match="no setting 'gamma': there are look, position"):
        Settings().with_changes(gamma=2.2)


def test_the_look_brings_its_tone_curve():
    assert Settings().tone_curve == "exponential"
    assert Settings(look="classic").tone_curve == "none"
    assert Settings(tone="none").as_dict()["tone"] == "none"


def test_settings_are_plain_json_also_from_numpy_numbers():
    settings = Settings(exposure=np.float32(2.0))
    assert json.loads(json.dumps(settings.as_dict())) == settings.as_dict()
    assert settings == Settings(exposure=2)
