"""A sweep: its texts become checked values, its combinations changed settings, parameters and folders."""

from __future__ import annotations

import json
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from firefly_sample.capture.sweep import MAX_COMBINATIONS, apply, combinations, folder_of, parse_sweep
from firefly_sample.errors import FireflyError, ParameterError, SettingsError
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scenes.plugin import Plugin
from firefly_sample.settings import Settings

GARDEN = Plugin(
    "garden",
    "Every type of parameter, and names that options and settings have as well.",
    (
        Parameter("fireflies", int, 40, "How many.", 0, 20_000),
        Parameter("reach", float, 2.5, "How far.", 0.0, 100.0),
        Parameter("dusk", bool, True, "Ambient light."),
        Parameter("file", str, "", "A file."),
        Parameter("weather", str, "dry", "The weather.", choices=("dry", "wet")),
        Parameter("size", float, 1.0, "How large."),
        Parameter("exposure", float, 1.0, "A setting's name.", -10.0, 10.0),
    ),
    build=lambda **_: None,
)
SHADY = Plugin("shady", "Settings of its own.", (), build=lambda: None, settings={"light_resolution": "half"})


def values(*texts):
    return parse_sweep(texts, GARDEN)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("fireflies=100,200", {"fireflies": (100, 200)}),
        ("fireflies = 3, 1 ,2", {"fireflies": (3, 1, 2)}),
        ("fireflies=0:4", {"fireflies": (0, 1, 2, 3)}),
        ("fireflies=10:0:-5", {"fireflies": (10, 5)}),
        ("fireflies=0:2,50,100:300:100", {"fireflies": (0, 1, 50, 100, 200)}),
        ("reach=1,2.5,1e1", {"reach": (1.0, 2.5, 10.0)}),
        ("reach=0:0.5:.1", {"reach": (0.0, 0.1, 0.2, 0.3, 0.4)}),
        ("dusk=yes,false", {"dusk": (True, False)}),
        ("weather=dry,wet", {"weather": ("dry", "wet")}),
        ("file=b.glb,a.glb", {"file": ("b.glb", "a.glb")}),
        ('file=["a.glb,b.glb", " c", ""]', {"file": ("a.glb,b.glb", " c", "")}),
        ('file=["0:3"]', {"file": ("0:3",)}),
        ("file=scenes.mine:lamp", {"file": ("scenes.mine:lamp",)}),
        ("size=1,2", {"size": (1.0, 2.0)}),
        ("scene-size=1,2", {"size": (1.0, 2.0)}),
        ("exposure=auto,1:3", {"exposure": ("auto", 1.0, 2.0)}),
        ("scene_exposure=-1:1", {"scene_exposure": (-1.0, 0.0)}),
        ("normal-format=oct8,oct16", {"normal_format": ("oct8", "oct16")}),
        ("cutoff_threshold=none,0.01", {"cutoff_threshold": (None, 0.01)}),
        ("tone=none,absent", {"tone": ("none", None)}),
        ("shadow_taps=1:5:3", {"shadow_taps": (1, 4)}),
        ("volume_depth_test=true,false", {"volume_depth_test": (True, False)}),
        ('exposure=["auto", 2]', {"exposure": ("auto", 2.0)}),
        ("cutoff_threshold=[null]", {"cutoff_threshold": (None,)}),
        ("preset=fast,accurate", {"preset": ("fast", "accurate")}),
    ],
)
def test_texts(text, expected):
    found = values(text)
    assert found == expected
    (kinds,), (wanted,) = (
        [[type(one) for one in each] for each in part.values()] for part in (found, expected)
    )
    assert kinds == wanted
    name, _, rest = text.partition("=")
    assert parse_sweep({name: rest.strip()}, GARDEN) == expected


def test_python_values():
    sweep = {"fireflies": range(100, 300, 100), "exposure": np.array([0.5, 1.0]), "dusk": [np.bool_(True)]}
    found = parse_sweep(sweep, GARDEN)
    assert found == {"fireflies": (100, 200), "exposure": (0.5, 1.0), "dusk": (True,)}
    assert json.loads(json.dumps(found))["exposure"] == [0.5, 1.0]
    assert parse_sweep({}, GARDEN) == {}


@pytest.mark.parametrize(
    ("text", "error", "said"),
    [
        ("fireflies", SettingsError, "sweep 'fireflies' must be NAME=VALUE,VALUE"),
        ("=1", SettingsError, "must be NAME=VALUE,VALUE"),
        (
            "fireflys=1",
            SettingsError,
            r"sweep 'fireflys': .* \(did you mean 'fireflies'\?\): the scene has fire",
        ),
        ("normals=oct8", SettingsError, "it is now called 'normal_format'"),
        ("fps=1,2", SettingsError, "neither a setting nor a parameter of scene 'garden'"),
        ("scene_tone=none", SettingsError, "neither a setting nor a parameter"),
        ("fireflies=1,x", ParameterError, "sweep 'fireflies': .* must be a whole number, got 'x'"),
        ("fireflies=1.5", ParameterError, "must be a whole number, got '1.5'"),
        ("fireflies=0:2:0.5", ParameterError, "must be a whole number, got 0.5"),
        ("fireflies=30000", ParameterError, "must be between 0 and 20000, got 30000"),
        ("reach=nan", ParameterError, "must be finite, got nan"),
        ("dusk=maybe", ParameterError, "must be true or false, got 'maybe'"),
        ("weather=dri", ParameterError, r"must be one of dry, wet, got 'dri' \(did you mean 'dry'\?\)"),
        ("fireflies=none", ParameterError, "must be a whole number, got 'none'"),
        (
            "exposure=none",
            SettingsError,
            "sweep 'exposure': setting 'exposure' must be .*, or auto; got 'none'",
        ),
        ("normal_format=0:2", SettingsError, "range '0:2' is for numbers only"),
        ("file=0:2", SettingsError, r'is for numbers only; as a text it is written \["0:2"\]'),
        ("dusk=0:2", SettingsError, "is for numbers only"),
        ("preset=fats", SettingsError, "there is no preset 'fats' .*did you mean 'fast'"),
        ("fireflies=", SettingsError, "a value is missing"),
        ("fireflies=1,,2", SettingsError, "a value is missing"),
        ("fireflies=[]", SettingsError, "it has no values"),
        ("fireflies=[1", SettingsError, "must be a JSON list"),
        ("fireflies=[[1]]", ParameterError, "must be a whole number"),
        ("reach=1,1.0", SettingsError, "sweep 'reach': the value 1.0 occurs twice"),
        ("cutoff_threshold=none,absent", SettingsError, "the value absent occurs twice"),
        ("fireflies=0:3,2", SettingsError, "the value 2 occurs twice"),
        ("fireflies=3:3", SettingsError, "holds no number"),
        ("fireflies=3:1", SettingsError, "holds no number"),
        ("fireflies=0:3:0", SettingsError, "the step must not be 0"),
        ("fireflies=0:1:2:3", SettingsError, "must be FIRST:END or FIRST:END:STEP"),
        ("fireflies=:3", SettingsError, "must be FIRST:END or FIRST:END:STEP"),
        ("reach=0:1e300", SettingsError, "too far from each other in size"),
        ("reach=0:1e9", SettingsError, "holds 1000000000 numbers, more than 10000"),
        ("reach=0:1:1e-200", SettingsError, "too far from each other in size"),
    ],
)
def test_wrong_texts(text, error, said):
    with pytest.raises(error, match=said) as caught:
        values(text)
    assert str(caught.value).startswith("sweep ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("sweep", "said"),
    [
        (["size=1", "scene_size=2"], "'size' occurs twice"),
        (["normal-format=oct8", "normal_format=oct16"], "'normal_format' occurs twice"),
        (["fireflies=0:101", "reach=0:10:0.1"], "101 x 100 = 10100 combinations are more than 10000"),
        ({"fireflies": 100}, "sweep 'fireflies': it must be several values"),
        ({"fireflies": []}, "it has no values"),
        ({1: [2]}, "a mapping of names"),
        ([3], "must be texts"),
    ],
)
def test_wrong_sweeps(sweep, said):
    with pytest.raises(SettingsError, match=said):
        parse_sweep(sweep, GARDEN)


def test_the_largest_sweep():
    assert len(list(combinations(values("fireflies=0:100", "reach=0:10:0.1")))) == MAX_COMBINATIONS


def test_the_last_name_changes_fastest():
    sweep = values("fireflies=1,2", "exposure=0.5,auto")
    assert list(combinations(sweep)) == [
        {"fireflies": 1, "exposure": 0.5},
        {"fireflies": 1, "exposure": "auto"},
        {"fireflies": 2, "exposure": 0.5},
        {"fireflies": 2, "exposure": "auto"},
    ]
    assert list(combinations({})) == [{}]


decimals = st.builds(lambda digits, point: f"{digits}e-{point}", st.integers(-9999, 9999), st.integers(0, 4))


@given(decimals, st.integers(1, 40), decimals.filter(lambda text: float(text) != 0), st.booleans())
@example("0", 10, "1e-1", True)
def test_ranges_are_exact(first, count, step, reached):
    """Against fractions: each number is the float that is nearest to first + i * step."""
    exact = [Fraction(first) + i * Fraction(step) for i in range(count)]
    end = exact[-1] + Fraction(step) * (1 if reached else Fraction(1, 2))
    scaled = end * 10**5
    assert scaled.denominator == 1
    plugin = Plugin("any", "", (Parameter("x", float, 0.0, ""),), build=lambda **_: None)
    found = parse_sweep([f"x={first}:{scaled.numerator}e-5:{step}"], plugin)["x"]
    assert found == tuple(float(number) for number in exact)


def test_settings_and_parameters_of_a_combination():
    given = Settings(supersample=2, normal_format="rgba8")
    combination = {"fireflies": 3, "exposure": 2.0, "scene_exposure": -1.0, "preset": "accurate"}
    changed, parameters = apply(combination, given, {"fireflies": 40, "reach": 2.5}, GARDEN)
    assert parameters == {"fireflies": 3, "reach": 2.5, "exposure": -1.0}
    # the preset, then the user's own settings, then those of the sweep
    assert changed == Settings.preset("accurate", supersample=2, normal_format="rgba8", exposure=2.0)
    assert apply({}, given, parameters, GARDEN) == (given, parameters)


def test_a_preset_gives_way_to_a_swept_setting():
    changed, _ = apply({"cutoff_budget": 1e-3, "preset": "fast"}, Settings(), {}, GARDEN)
    assert changed == Settings.preset("fast", cutoff_budget=1e-3)
    assert changed.cutoff_threshold is None
    changed, _ = apply({"look": "classic", "preset": "fast"}, Settings(), {}, GARDEN)
    assert (changed.normal_format, changed.volume_proxy) == ("oct16", "icosphere0")


def test_the_scenes_own_settings_give_way_and_those_of_the_user_do_not():
    own = Settings(light_resolution="half")
    assert apply({"shadow_taps": 1}, own, {}, SHADY)[0] == Settings(light_resolution="half", shadow_taps=1)
    changed, _ = apply({"light_method": "forward"}, own, {}, SHADY)
    assert (changed.light_method, changed.light_resolution) == ("forward", "full")
    # a default that the user has put in place of the scene's own setting
    assert apply({"shadow_taps": 1}, Settings(), {}, SHADY)[0].light_resolution == "full"
    said = (
        "^sweep fireflies=1,light_method=forward: setting 'light_resolution' must be full with light_method"
    )
    with pytest.raises(SettingsError, match=said):
        apply({"fireflies": 1, "light_method": "forward"}, own, {}, GARDEN)


@pytest.mark.parametrize(
    ("combination", "name"),
    [
        ({"fireflies": 100, "exposure": 0.5}, "fireflies=100,exposure=0.5"),
        (
            {"dusk": True, "cutoff_threshold": None, "reach": 1e-05},
            "dusk=true,cutoff_threshold=absent,reach=1e-05",
        ),
        ({"file": "walk.glb", "light_method": "auto"}, "file=walk.glb,light_method=auto"),
        ({}, ""),
    ],
)
def test_readable_folders(combination, name):
    assert folder_of(combination) == name


def test_folders_of_other_values_have_a_hash():
    name = folder_of({"file": "../A B,c=ü.glb", "reach": 1.0})
    assert name.startswith("file=.._A_B,c=_.glb,reach=1.0@")
    assert name != folder_of({"file": "../a b,c=ü.glb", "reach": 1.0})


texts = st.text(st.sampled_from("aAbB1.,=@-_ /\\:\0ü\udcff~"), max_size=6) | st.text(max_size=200)
chosen = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | texts
names = st.sampled_from(["fireflies", "n", "N", "_x", "größe", "a" * 80])
anything = st.dictionaries(names, chosen, min_size=1, max_size=4)
words = st.sampled_from(
    ["true", "absent", "1", "1.0", "a", "A", "a.", "a@0", True, None, 1, 1.0, "con", "1e+16", 1e16]
)


@settings(max_examples=60)
@given(st.lists(anything | st.dictionaries(names, words, min_size=1, max_size=2), max_size=6))
def test_distinct_combinations_have_distinct_safe_folders(several):
    several = {repr(sorted(one.items())): one for one in several}.values()
    found = [folder_of(one) for one in several]
    assert len({name.casefold() for name in found}) == len(found)
    for name in found:
        assert 0 < len(name) <= 150
        assert name.isascii()
        assert name.isprintable()
        assert not set(name) & set('<>:"/\\|?* ')
        assert name[0] not in ".-"
        assert name[-1] != "."


def test_folders_stay_when_a_sweep_gets_more_values():
    few, many = (
        {folder_of(each) for each in combinations(values(text, "dusk=true,false"))}
        for text in ("reach=1,3", "reach=3,2,1")
    )
    assert few < many
    assert len(many) == math.prod((3, 2))


typed = st.text(st.sampled_from('0123456789:.,eE+-[]"{}abnul \n'), max_size=12)


@given(typed, st.sampled_from(GARDEN.parameters))
def test_whatever_is_typed_gives_values_or_one_line(text, parameter):
    said = ""
    try:
        found = values(f"{parameter.name}={text}")
    except FireflyError as error:
        said = str(error)
    assert "\n" not in said
    assert said or 0 < sum(map(len, found.values())) <= MAX_COMBINATIONS
