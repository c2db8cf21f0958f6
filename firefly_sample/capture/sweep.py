"""The sweep of a capture: all combinations of some values of scene parameters and settings."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Context, Decimal, DecimalException, Inexact, InvalidOperation, localcontext
from typing import Any

from firefly_sample.errors import FireflyError, SettingsError, did_you_mean
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.scene import ScenePlugin
from firefly_sample.scenes.plugin import scene_settings
from firefly_sample.settings import PRESETS, SETTINGS, Settings, preset_with

Value = bool | int | float | str | None
Sweep = dict[str, tuple[Value, ...]]

MAX_COMBINATIONS = 10_000
"""The most combinations of a sweep, each of which has a folder of its own."""
_LONGEST = 150
"""Characters of a folder's name; file systems allow 255 bytes, and whole paths are limited as well."""
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_RANGE = re.compile(rf"({_NUMBER})\s*:\s*({_NUMBER})(?:\s*:\s*({_NUMBER}))?", re.ASCII)
_WORDS: dict[str, bool] = {
    **dict.fromkeys(("true", "t", "yes", "y", "1"), True),
    **dict.fromkeys(("false", "f", "no", "n", "0"), False),
}
"""What the command line takes for True and False."""
_PLAIN_TEXT = re.compile(r"[a-z](?:[a-z0-9_.-]*[a-z0-9_-])?", re.ASCII)
"""Text that a folder's name can show as it is: lower case, and no other value is shown like it."""
_UNSAFE = re.compile(r"[^A-Za-z0-9_.=,-]", re.ASCII)


@dataclass(frozen=True)
class _Subject:
    """A scene parameter or a setting that can be swept, or ``preset``."""

    type: type
    check: Callable[[Any], Value]
    parameter: str = ""
    """The parameter's name; empty for a setting."""
    words: tuple[str, ...] = ()
    may_be_absent: bool = False

    def from_text(self, text: str) -> Any:
        """Return the value that a text means, or else the text itself, which the check will refuse."""
        if text in self.words:
            return text
        if self.may_be_absent and text in ("none", "absent"):
            return None
        if self.type is bool:
            return _WORDS.get(text.lower(), text)
        try:
            return text if self.type is str else self.type(text)
        except ValueError:
            return text


def parse_sweep(sweep: Iterable[str] | Mapping[str, object], plugin: ScenePlugin) -> Sweep:
    """Return the checked values of a sweep by name; the last name is to change fastest.

    A name is that of a scene parameter or a setting, with dashes or underscores, or ``preset``. Where a
    parameter is called like a setting, the name means the setting, and ``scene_NAME`` means the parameter.

    Parameters
    ----------
    sweep : iterable of str, or mapping
        Texts such as "fireflies=100,200", "exposure=0:1:0.1" or 'file=["a.glb,b.glb", "c.glb"]', or a
        mapping of names to what follows the "=", or to iterables of values. Commas separate values and
        ranges FIRST:END[:STEP], whose end is not included. A text that begins with "[" is a JSON list of
        values, which may contain commas. "none" and "absent" mean that a setting is absent.
    plugin : ScenePlugin

    Raises
    ------
    SettingsError
        If a name is unknown or occurs twice, a value occurs twice, a list is empty, a range is no range or
        not of numbers, or there are more than `MAX_COMBINATIONS`.
    FireflyError
        If the parameter or the setting refuses a value.
    """
    subjects = _subjects(plugin)
    values: Sweep = {}
    for name, given in _pairs(sweep):
        key = _key(name, subjects, plugin)
        if key in values:
            raise SettingsError(f"sweep {name!r}: {key!r} occurs twice: give all its values at once")
        try:
            values[key] = _checked(given, subjects[key])
        except FireflyError as error:
            raise type(error)(f"sweep {name!r}: {error}") from error
    counts = [len(each) for each in values.values()]
    if math.prod(counts) > MAX_COMBINATIONS:
        product = " x ".join(map(str, counts))
        raise SettingsError(
            f"sweep: {product} = {math.prod(counts)} combinations are more than {MAX_COMBINATIONS}: "
            "sweep over fewer values, or make several captures"
        )
    return values


def combinations(sweep: Mapping[str, tuple[Value, ...]]) -> Iterator[dict[str, Value]]:
    """Yield each combination of a sweep's values by name; the last name changes fastest."""
    for each in itertools.product(*sweep.values()):
        yield dict(zip(sweep, each, strict=True))


def apply(
    values: Mapping[str, Value], settings: Settings, parameters: Mapping[str, Any], plugin: ScenePlugin
) -> tuple[Settings, dict[str, Any]]:
    """Return settings and parameters with one combination of a sweep applied.

    Swept settings come before all others, then those of `settings` that are neither a default nor the
    scene's own, then those of a swept preset, then the scene's own, which give way where they contradict.

    Raises
    ------
    SettingsError
        If settings contradict each other; the message names the combination.
    """
    subjects = _subjects(plugin)
    base = Settings().with_changes(**scene_settings(plugin))
    changes = {name: getattr(settings, name) for name in SETTINGS}
    changes = {name: value for name, value in changes.items() if value != getattr(base, name)}
    changes |= {name: value for name, value in values.items() if name in SETTINGS}
    if "preset" in values:
        changes = preset_with(str(values["preset"]), changes)
    try:
        changed = Settings().with_changes(**scene_settings(plugin, changes))
    except SettingsError as error:
        raise SettingsError(f"sweep {_shown(values)}: {error}") from error
    swept = {subjects[name].parameter: value for name, value in values.items() if subjects[name].parameter}
    return changed, {**parameters, **swept}


def folder_of(values: Mapping[str, Value]) -> str:
    """Return the name of a combination's folder, for example ``fireflies=100,exposure=0.5``.

    It depends only on this combination, and is "" for an empty one. It has at most 150 ASCII characters, all
    of which Linux, macOS and Windows allow. Where it cannot show every value exactly, also where letters
    differ only in case, a hash of the values follows after "@", so that no two combinations share a name.
    """
    shown = _shown(values)
    plain = all(_PLAIN_TEXT.fullmatch(name) and _is_plain(value) for name, value in values.items())
    if plain and len(shown) <= _LONGEST:
        return shown
    digest = hashlib.sha256(json.dumps(dict(values)).encode()).hexdigest()[:12]
    safe = re.sub(r"^\.", "_", _UNSAFE.sub("_", shown))
    return f"{safe[: _LONGEST - 1 - len(digest)]}@{digest}"


def _subjects(plugin: ScenePlugin) -> dict[str, _Subject]:
    """Return all that can be swept, by the names that manifests and folders have for them."""
    subjects = {
        name: _Subject(
            setting.type, setting.check, "", (*setting.choices, *setting.words), bool(setting.absent)
        )
        for name, setting in SETTINGS.items()
    }
    subjects["preset"] = _Subject(str, _check_preset)
    for parameter in plugin.parameters:
        key = f"scene_{parameter.name}" if parameter.name in subjects else parameter.name
        subjects[key] = _Subject(parameter.type, _check_of(parameter, plugin), parameter.name)
    return subjects


def _check_of(parameter: Parameter, plugin: ScenePlugin) -> Callable[[Any], Value]:
    def check(value: Any) -> Value:
        checked: Value = parameter.check(value, plugin.name)
        return checked

    return check


def _check_preset(value: Any) -> Value:
    if not (isinstance(value, str) and value in PRESETS):
        hint = did_you_mean(str(value), PRESETS)
        raise SettingsError(f"there is no preset {value!r}{hint}: there are {', '.join(PRESETS)}")
    return value


def _key(name: str, subjects: Mapping[str, _Subject], plugin: ScenePlugin) -> str:
    """Return the name under which `subjects` has what a user calls `name`."""
    plain = name.strip().replace("-", "_")
    for key in (plain, plain.removeprefix("scene_")):
        if key in subjects and (key == plain or subjects[key].parameter):
            return key
    of_scene = [key for key, subject in subjects.items() if subject.parameter]
    raise SettingsError(
        f"sweep {name!r}: there is neither a setting nor a parameter of scene {plugin.name!r} with this name"
        f"{did_you_mean(plain, subjects)}: the scene has {', '.join(of_scene) or 'none'}; "
        f"the settings are preset, {', '.join(SETTINGS)}"
    )


def _pairs(sweep: Iterable[str] | Mapping[str, object]) -> Iterator[tuple[str, object]]:
    """Yield the names of a sweep, each with its values or their text."""
    if isinstance(sweep, str):
        sweep = [sweep]
    for entry in sweep.items() if isinstance(sweep, Mapping) else sweep:
        if isinstance(entry, str):
            name, found, text = entry.partition("=")
            if not (found and name.strip()):
                raise SettingsError(
                    f"sweep {entry!r} must be NAME=VALUE,VALUE,... or NAME=FIRST:END[:STEP], "
                    "for example fireflies=100,200"
                )
            yield name.strip(), text.strip()
        elif isinstance(entry, tuple) and isinstance(entry[0], str):
            yield entry[0], entry[1]
        else:
            raise SettingsError(f"sweep must be texts, or a mapping of names to values, got {entry!r}")


def _checked(given: object, subject: _Subject) -> tuple[Value, ...]:
    """Return the values that a text means, or those of an iterable, each checked."""
    raw: list[Any]
    if isinstance(given, str) and given.startswith("["):
        try:
            raw = json.loads(given)
        except (ValueError, RecursionError) as error:
            raise SettingsError(
                f'it must be a JSON list such as ["a,b", "c"], got {given!r}: {error}'
            ) from None
    elif isinstance(given, str):
        raw = [value for item in given.split(",") for value in _item(item.strip(), subject)]
    elif isinstance(given, Iterable):
        raw = list(itertools.islice(given, MAX_COMBINATIONS + 1))
    else:
        raise SettingsError(f"it must be several values, or a text such as '1,2', got {given!r}")
    if not raw:
        raise SettingsError("it has no values")
    values: dict[Value, None] = {}
    for value in map(subject.check, raw):
        if value in values:
            raise SettingsError(f"the value {_text(value)} occurs twice")
        values[value] = None
    return tuple(values)


def _item(text: str, subject: _Subject) -> list[Any]:
    """Return the value or the values of a range that stands between commas."""
    if not text:
        raise SettingsError('a value is missing; an empty text is written as a JSON list: [""]')
    is_number = subject.type in (int, float)
    if ":" in text and (is_number or _RANGE.fullmatch(text)):
        if not is_number:
            raise SettingsError(f'the range {text!r} is for numbers only; as a text it is written ["{text}"]')
        return _range(text)
    return [subject.from_text(text)]


def _range(text: str) -> list[int | float]:
    """Return the numbers of a range, each the float that is nearest to the exact decimal number."""
    match = _RANGE.fullmatch(text)
    if match is None:
        raise SettingsError(f"a range must be FIRST:END or FIRST:END:STEP, got {text!r}")
    first, end, step = (Decimal(part or 1) for part in match.groups())
    if not step:
        raise SettingsError(f"range {text!r}: the step must not be 0")
    if first == end or (end > first) != (step > 0):
        raise SettingsError(
            f"range {text!r} holds no number: it goes from its first by steps, without the end"
        )
    with localcontext(Context(prec=60, traps=[Inexact, InvalidOperation])):
        try:
            whole, rest = divmod(end - first, step)
            count = int(whole) + bool(rest)
            if count > MAX_COMBINATIONS:
                raise SettingsError(f"range {text!r} holds {count} numbers, more than {MAX_COMBINATIONS}")
            numbers = [first + step * index for index in range(count)]
            return [int(each) if each == each.to_integral_value() else float(each) for each in numbers]
        except DecimalException:
            raise SettingsError(f"range {text!r}: its numbers are too far from each other in size") from None


def _shown(values: Mapping[str, Value]) -> str:
    """Return a combination as people write it."""
    return ",".join(f"{name}={_text(value)}" for name, value in values.items())


def _text(value: Value) -> str:
    if value is None:
        return "absent"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _is_plain(value: Value) -> bool:
    """Return True if no other value is shown as this one, and none that differs from it only in case."""
    if isinstance(value, str):
        return bool(_PLAIN_TEXT.fullmatch(value)) and value not in ("true", "false", "absent")
    return _UNSAFE.search(_text(value)) is None
