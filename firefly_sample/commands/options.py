"""Options that commands share, and those that come from `Settings` and from a scene's parameters."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter, Token

from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.frame import OUTPUTS
from firefly_sample.scene.scene import START_TIME
from firefly_sample.scenes.files import complete_files, is_file_name
from firefly_sample.scenes.plugin import scene_settings, start_time
from firefly_sample.settings import PRESETS, SETTINGS, Setting, preset_with

if TYPE_CHECKING:
    from firefly_sample.scene.parameter import Parameter as SceneParameter
    from firefly_sample.scene.scene import ScenePlugin

Command = Callable[..., int]

DEFAULT_SCENE = "forest"
COMMAND_OPTIONS = frozenset(
    {
        *("budget_ms", "counts", "device", "dot", "fps", "frames", "fresh", "h", "headless", "help"),
        *("help_all", "json", "longest", "max_codes", "max_error", "methods", "o", "output", "outputs"),
        *("performance_test", "preset", "q", "quiet", "require_gpu", "rounds", "scene", "seconds", "seeds"),
        *("size", "sizes", "time", "version"),
        *("resume", "overwrite", "fail_fast", "workers", "cluster", "shard", "sweep", "views", "dataset"),
        *("format", "formats", "quality", "depth_scale", "crf", "pad"),
    }
)
"""Names of the options of all commands that take a scene, without those of settings."""
_ONLY_IN_FULL_HELP = frozenset(
    {
        *("budget_ms", "cluster", "device", "fail_fast", "max_codes", "max_error", "require_gpu", "shard"),
        *("sweep", "formats", "quality", "depth_scale", "crf", "pad"),
    }
)
"""Options of commands that only --help-all shows, as it does those of settings."""
_SHORT_HELP = {"outputs": "Images to make: color,depth,id, ..."}
"""The help of options whose whole help is long."""
_FILE_ENDINGS = frozenset((".png", ".jpg", ".jpeg", ".exr", ".npz", ".npy", ".json", ".md", ".gif", ".mp4"))


def _one(convert: Callable[[str], Any]) -> Callable[[Any, Sequence[Token]], Any]:
    """Return a converter of one value."""
    return lambda _, tokens: convert(tokens[0].value)


def _list(convert: Callable[[str], Any]) -> Callable[[Any, Sequence[Token]], tuple[Any, ...]]:
    """Return a converter of values that are separated by commas, or stand in several tokens."""
    return lambda _, tokens: tuple(convert(text) for token in tokens for text in token.value.split(","))


def _names(_: Any, tokens: Sequence[Token]) -> tuple[str, ...]:
    return tuple(filter(None, _list(str.strip)(_, tokens)))


def _to_size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,9})[x×](\d{1,9})", text.strip(), re.ASCII)
    if match is None:
        raise ValueError(f"a size is WIDTHxHEIGHT in pixels, for example 800x600, got {text!r}")
    width, height = int(match[1]), int(match[2])
    if not (width and height):
        raise ValueError(f"width and height must be 1 or more, got {text!r}")
    return width, height


def _to_folder(text: str) -> Path:
    if not text.strip() or "\0" in text:
        raise ValueError(f"it must name a folder, got {text!r}; the working folder is '.'")
    folder = Path(text)
    if folder.suffix.lower() in _FILE_ENDINGS and not folder.is_dir():
        raise ValueError(
            f"it must name a folder, whose files get names of their own; {text!r} looks like a file"
        )
    return folder


def _to_folder_or_file(text: str) -> Path:
    from firefly_sample.capture.one_file import is_one_file

    path = Path(text)
    return path if path.name and "\0" not in text and is_one_file(path) else _to_folder(text)


def _to_whole(text: str) -> int:
    # cyclopts' own conversion rounds 7.6 to 8 without saying so
    try:
        number = int(text)
    except ValueError:
        raise ValueError(f"it must be a whole number, got {text!r}") from None
    if abs(number) >= 2**64:
        raise ValueError(f"it must be less than 2**64, got {text}")
    return number


def _to_workers(text: str) -> int | Literal["auto"]:
    return "auto" if text.strip() == "auto" else _to_whole(text)


def _scene_names(context: Any) -> list[str]:
    """Return the installed scenes and the files of models, for a shell that completes a command line."""
    from importlib.metadata import entry_points

    from firefly_sample.scenes import ENTRY_POINT_GROUP

    return [*sorted(entry_points(group=ENTRY_POINT_GROUP).names), *complete_files(context.incomplete)]


def _to_scene(_: Any, tokens: Sequence[Token]) -> str:
    """Return the name of one scene, or of several files with commas between them."""
    names = [token.value for token in tokens]
    if len(names) > 1 and not all(map(is_file_name, names)):
        listed = ", ".join(map(repr, names))
        raise ValueError(f"several files of models can be one scene, but nothing else: got {listed}")
    return ",".join(names)


def _to_first_scene(_: Any, tokens: Sequence[Token]) -> str:
    """Return the first name: after it come the values of options that are not known yet."""
    return tokens[0].value


SceneName = Annotated[
    str,
    Parameter(
        help="The scene by name, the files of models, or package.module:object.",
        converter=_to_scene,
        n_tokens=-1,
        completer=_scene_names,
        metavar="SCENE",
    ),
]
Names = Annotated[tuple[str, ...], Parameter(converter=_names, n_tokens=1, metavar="NAMES")]
Outputs = Annotated[
    Names,
    Parameter(
        help=f"Images to make, separated by commas, from: {', '.join(OUTPUTS)}.",
        completer=lambda _: list(OUTPUTS),
        show_default=",".join,
    ),
]
Size = Annotated[
    tuple[int, int],
    Parameter(
        help="Width and height in pixels.",
        converter=_one(_to_size),
        n_tokens=1,
        metavar="WxH",
        show_default=lambda size: "x".join(map(str, size)),
        allow_leading_hyphen=True,
    ),
]
Sizes = Annotated[
    tuple[tuple[int, int], ...],
    Parameter(
        name=["--sizes", "--size"],
        converter=_list(_to_size),
        n_tokens=1,
        metavar="WxH,...",
        show_default=lambda sizes: ",".join(f"{width}x{height}" for width, height in sizes),
        allow_leading_hyphen=True,
    ),
]
Folder = Annotated[Path, Parameter(converter=_one(_to_folder), metavar="DIR")]
FolderOrFile = Annotated[Path, Parameter(converter=_one(_to_folder_or_file), metavar="DIR|FILE")]
Whole = Annotated[int, Parameter(converter=_one(_to_whole), metavar="INT")]
Wholes = Annotated[tuple[int, ...], Parameter(converter=_list(_to_whole), n_tokens=1, metavar="INTS")]
Patterns = Annotated[
    tuple[str, ...],
    Parameter(
        converter=lambda _, tokens: tuple(token.value for token in tokens), n_tokens=1, metavar="PATTERN"
    ),
]
Workers = Annotated[
    int | Literal["auto"] | None, Parameter(converter=_one(_to_workers), metavar="N|auto", show_choices=False)
]
Sweep = Annotated[
    tuple[str, ...],
    Parameter(
        converter=lambda _, tokens: tuple(token.value for token in tokens),
        n_tokens=1,
        metavar="NAME=A,B,...",
    ),
]
Time = Annotated[float, Parameter(metavar="SECONDS")]
StartTime = Annotated[
    float | None,
    Parameter(metavar="SECONDS", show_default=lambda _: f"{START_TIME}; 0.0 for files of models"),
]
"""The time of a frame, the scene's `start_time` when absent."""
Flag = Annotated[bool, Parameter(show_default=False)]
Device = Annotated[
    Whole | None, Parameter(help="The number of the EGL device to draw with (see firefly doctor).")
]
RequireGpu = Annotated[Flag, Parameter(help="Fail if the only driver is a software driver.")]


def without_settings(*names: str) -> Callable[[Command], Command]:
    """Decorate a command that has no option for these settings, because they make no sense there."""

    def mark(command: Command) -> Command:
        command.__dict__["settings_left_out"] = frozenset(names)
        return command

    return mark


def with_scene_options(
    command: Command, plugin: ScenePlugin, full_help: bool = True, find_scene_only: bool = False
) -> Command:
    """Return `command` with an option for each setting and each parameter of a scene; see `scene_options`.

    It takes ``settings`` and ``parameters``, dicts of those that are given, as keyword arguments; the first
    also has the scene's own settings. Without `full_help` the help shows only options that most people need.
    With `find_scene_only` it is made to find out the scene, by a command line that may have options of this
    scene, which are unknown as yet.
    """
    signature = inspect.signature(command, eval_str=True)
    left_out: frozenset[str] = getattr(command, "settings_left_out", frozenset())
    own = scene_settings(plugin)
    about = "Settings to start from; other options override them."
    options = [
        *(
            _with_default(p, start_time(plugin)) if p.name == "time" and p.default is None else p
            for p in signature.parameters.values()
            if p.name not in ("settings", "parameters")
        ),
        _option("settings__preset", "--preset", Literal[tuple(PRESETS)], about, "balanced"),
        *_settings_options(left_out, own),
        *_scene_parameters(plugin),
    ]
    if find_scene_only:
        first = Parameter(converter=_to_first_scene, n_tokens=1)
        options = [
            p.replace(annotation=Annotated[p.annotation, first]) if p.name == "scene" else p for p in options
        ]
    if not full_help:
        hidden = _ONLY_IN_FULL_HELP | {f"settings__{name}" for name in SETTINGS.keys() - own.keys()}
        changes = {name: Parameter(show=False) for name in hidden}
        changes |= {name: Parameter(help=text) for name, text in _SHORT_HELP.items()}
        options = [
            p.replace(annotation=Annotated[p.annotation, changes[p.name]]) if p.name in changes else p
            for p in options
        ]

    @functools.wraps(command)
    def run(*arguments: Any, **values: Any) -> int:
        given: dict[str, dict[str, Any]] = {"settings": {}, "parameters": {}, "": {}}
        for name, value in values.items():
            kind, found, bare = name.partition("__")
            given[kind if found else ""][bare or name] = value
        settings, rest = given["settings"], given[""]
        preset: str | None = settings.pop("preset", None)
        bounds = [
            _dashed(name) for name in ("max_error", "max_codes", "budget_ms") if rest.get(name) is not None
        ]
        presets = ["--preset"] if preset is not None else []
        if any(text.partition("=")[0].strip() == "preset" for text in rest.get("sweep", ())):
            presets.append("--sweep preset")
        if presets and len(presets) + len(bounds) > 1:
            first, second, *_ = presets + bounds
            raise SettingsError(f"{first} and {second} both choose settings: leave one of them out")
        if preset is not None:
            settings = preset_with(preset, settings)
        settings = scene_settings(plugin, settings)
        settings = {name: value for name, value in settings.items() if name not in left_out}
        return command(*arguments, settings=settings, parameters=given["parameters"], **rest)

    run.__signature__ = signature.replace(parameters=options)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in options}
    return run


def scene_options(plugin: ScenePlugin) -> dict[str, SceneParameter]:
    """Return a scene's parameters by their options, for example ``--fireflies``, the same in all commands.

    A parameter whose name is that of another option of any command, say "size", has ``--scene-size``. Raises
    a SceneError if two parameters would have the same option.
    """
    taken = COMMAND_OPTIONS | SETTINGS.keys()
    parameters: dict[str, SceneParameter] = {}
    for p in plugin.parameters:
        name = f"scene_{p.name}" if p.name in taken else p.name
        if name in taken or _dashed(name) in parameters:
            raise SceneError(
                f"scene {plugin.name!r}: parameter {p.name!r} needs another name, it occurs twice"
            )
        parameters[_dashed(name)] = p
    return parameters


def _dashed(name: str) -> str:
    return "--" + name.replace("_", "-")


def _option(
    key: str, name: str, hint: Any, about: str, default: object, group: Group | str = "Options"
) -> inspect.Parameter:
    """Return a keyword `key` that is absent unless its option is given; the help shows `default`."""
    option = Parameter(
        name=name,
        help=about,
        group=group,
        show_default=lambda _: str(default),
        negative=None if default is True else (),
    )
    return inspect.Parameter(
        key,
        inspect.Parameter.KEYWORD_ONLY,
        default=None,
        annotation=Annotated[Whole if hint is int else hint, option],
    )


def _with_default(parameter: inspect.Parameter, default: float) -> inspect.Parameter:
    """Return a parameter of a command for which the help shows a default; it stays absent."""
    show = Parameter(show_default=lambda _: str(default))
    return parameter.replace(annotation=Annotated[parameter.annotation, show])


def _settings_options(left_out: frozenset[str], own: Mapping[str, Any]) -> Iterator[inspect.Parameter]:
    """Yield an option for each setting; `own` are those of the scene, which the help shows as defaults."""
    group = Group("Settings", sort_key=2)
    for name, setting in SETTINGS.items():
        if name not in left_out:
            hint: Any = Literal[setting.choices] if setting.type is str else setting.type
            if setting.words:
                hint = _number_or_word(setting)
            default = own.get(name, setting.default)
            default = setting.absent if default is None else default
            about = setting.help
            if setting.type is int:
                numbers = ", ".join(map(str, setting.choices)) or " to ".join(map(str, setting.range))
                about = f"{about.rstrip('.')} ({numbers})."
            yield _option(f"settings__{name}", _dashed(name), hint, about, default, group)


def _number_or_word(setting: Setting) -> Any:
    """Return the type of an option whose value is a number, or one of a few words."""

    def convert(text: str) -> float | str:
        number = _float_or_none(text)
        if number is None and text not in setting.words:
            raise ValueError(f"it must be {setting.expected}, got {text!r}")
        return text if number is None else number

    metavar = "|".join(("FLOAT", *setting.words))
    return Annotated[Any, Parameter(converter=_one(convert), n_tokens=1, metavar=metavar)]


def _float_or_none(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _scene_parameters(plugin: ScenePlugin) -> Iterator[inspect.Parameter]:
    group = Group(f"Scene {plugin.name}", sort_key=1)
    for option, p in scene_options(plugin).items():
        hint = Literal[p.choices] if p.choices else p.type
        yield _option(f"parameters__{p.name}", option, hint, parameter_help(p), p.default, group)


def parameter_help(parameter: SceneParameter) -> str:
    """Return a parameter's help with range and unit, for example "Its height (between 0 and 9 units)."."""
    if parameter.maximum is not None and parameter.maximum >= 2**63 - 1:  # of a seed: no limit for people
        parameter = replace(parameter, maximum=None)
    ranged = parameter.minimum is not None or parameter.maximum is not None
    about = " ".join(part for part in (parameter.range_text() if ranged else "", parameter.unit) if part)
    return f"{parameter.help.rstrip('.')} ({about})." if about else parameter.help
