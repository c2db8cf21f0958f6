"""Options that commands share, and those that come from `Settings` and from a scene's parameters."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_type_hints

from cyclopts import Group, Parameter, Token

from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.frame import OUTPUTS
from firefly_sample.settings import PRESETS, Settings, preset_with

if TYPE_CHECKING:
    from firefly_sample.scene.parameter import Parameter as SceneParameter
    from firefly_sample.scene.scene import ScenePlugin

DEFAULT_SCENE = "forest"
COMMAND_OPTIONS = frozenset(
    {
        *("budget_ms", "device", "dot", "fps", "frames", "fresh", "h", "headless", "help"),
        *("json", "lights", "longest", "max_codes", "max_error", "methods", "o", "output"),
        *("outputs", "performance_test", "preset", "q", "quiet", "require_gpu", "rounds"),
        *("scene", "seconds", "seeds", "size", "sizes", "time", "version"),
    }
)
"""Names of the options of all commands that take a scene, without those of settings."""

SETTINGS_HELP = {
    "look": "Correct shading, or classic: as Panda3D's sample shades, to compare with, including its faults "
    "(wrong normals, light added in 8 bits).",
    "position": "Where a pixel's position comes from: its own target, or a depth buffer.",
    "normals": "How normals are stored.",
    "albedo": "How base colours are stored.",
    "interpolation": "How normals and distances get from corners to pixels: float64 mends thin triangles.",
    "accumulation": "What lights are added up in.",
    "light_method": "Volumes, cells with lists of lights, the cheaper of both, or what is there to be measured.",
    "volume_proxy": "The mesh drawn for a light's sphere: fewer triangles, or fewer fragments.",
    "light_resolution": "Light every pixel, or every second one across and down and spread it.",
    "volume_depth_test": "Shade light volumes only where they end behind the surface.",
    "cutoff_budget": "Exposed radiance that all lights together may lose at a pixel by being cut off.",
    "cutoff_threshold": "Cut each light off at this radiance instead, for example 0.0195, which is 5/256.",
    "range_falloff": "How a light with a max distance ends.",
    "specular_model": "How highlights are computed.",
    "clamp_light": "Limit each light to the surface's own colour, and its highlight to 1.",
    "shadow_taps": "Comparisons with the shadow map at each pixel: 1, 4 or 16.",
    "shadow_resolution": "Texels along a side of every shadow map, in place of the lights' own.",
    "shadow_atlas": "Texels along a side that the texture of all shadow maps may have.",
    "particle_shadows": "How particles shadow each other: sums of optical depths, blended alphas, or a loop.",
    "particle_shadow_slices": "Slices of a cloud of particles along its light: 8 to 256.",
    "particle_shadow_tile": "Texels across each slice: 16 to 1024.",
    "particle_shadow_format": "How a slice's texels are stored.",
    "particle_shadow_reads": "Slices, the nearest before its own, that particle-shadows=loop adds up for a particle.",
    "particle_shadow_interpolation": "Shadows between slices by the depth in them, not in steps.",
    "particle_order": "Draw particles back to front along the view or the half-angle axis, or unsorted.",
    "particle_order_depths": "Depths that the order of particles tells apart.",
    "supersample": "2 averages four samples a pixel.",
    "exposure": "Radiance is multiplied by it.",
    "tone": "The curve from radiance to display.",
}
_OF_FILES = frozenset((".png", ".jpg", ".jpeg", ".exr", ".npz", ".npy", ".json", ".md", ".gif", ".mp4"))
_SETTINGS_DEFAULT = {
    "cutoff_threshold": "none, the budget",
    "shadow_resolution": "each light's own",
    "tone": "the look's own",
    "particle_shadow_reads": "all",
    "particle_order_depths": "all",
    "supersample": "1; 2 to capture color alone",
}


def _outputs(_: Any, tokens: Sequence[Token]) -> tuple[str, ...]:
    return tuple(name.strip() for token in tokens for name in token.value.split(",") if name.strip())


def _patterns(_: Any, tokens: Sequence[Token]) -> tuple[str, ...]:
    return tuple(token.value for token in tokens)


def _size(_: Any, tokens: Sequence[Token]) -> tuple[int, int]:
    return _to_size(tokens[0].value)


def _sizes(_: Any, tokens: Sequence[Token]) -> tuple[tuple[int, int], ...]:
    return tuple(_to_size(text) for token in tokens for text in token.value.split(","))


def _to_size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,9})[x×](\d{1,9})", text.strip(), re.ASCII)
    if match is None:
        raise ValueError(f"a size is WIDTHxHEIGHT in pixels, for example 800x600, got {text!r}")
    width, height = int(match[1]), int(match[2])
    if not (width and height):
        raise ValueError(f"width and height must be 1 or more, got {text!r}")
    return width, height


def _folder(_: Any, tokens: Sequence[Token]) -> Path:
    text = tokens[0].value
    if not text.strip() or "\0" in text:
        raise ValueError(f"it must name a folder, got {text!r}; the working folder is '.'")
    folder = Path(text)
    if folder.suffix.lower() in _OF_FILES and not folder.is_dir():
        raise ValueError(
            f"it must name a folder, whose files get names of their own; {text!r} is called like a file"
        )
    return folder


def _whole(_: Any, tokens: Sequence[Token]) -> int:
    # cyclopts' own conversion rounds 7.6 to 8 without a word
    return _to_whole(tokens[0].value)


def _wholes(_: Any, tokens: Sequence[Token]) -> tuple[int, ...]:
    return tuple(_to_whole(text) for token in tokens for text in token.value.split(","))


def _to_whole(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        raise ValueError(f"it must be a whole number, got {text!r}") from None
    if abs(number) >= 2**64:
        raise ValueError(f"it must be less than 2**64, got {text}")
    return number


SceneName = Annotated[
    str,
    Parameter(
        help="A scene by name (see firefly scenes), or package.module:object. Give it before its options."
    ),
]
Outputs = Annotated[
    tuple[str, ...],
    Parameter(
        help=f"Images to make, separated by commas, from: {', '.join(OUTPUTS)}.",
        converter=_outputs,
        n_tokens=1,
        metavar="NAMES",
        show_default=",".join,
        negative=(),
    ),
]
Size = Annotated[
    tuple[int, int],
    Parameter(
        help="Width and height in pixels.",
        converter=_size,
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
        converter=_sizes,
        n_tokens=1,
        metavar="WxH,...",
        show_default=lambda sizes: ",".join(f"{width}x{height}" for width, height in sizes),
        allow_leading_hyphen=True,
        negative=(),
    ),
]
Folder = Annotated[Path, Parameter(converter=_folder, metavar="DIR")]
Whole = Annotated[int, Parameter(converter=_whole, metavar="INT")]
Wholes = Annotated[tuple[int, ...], Parameter(converter=_wholes, n_tokens=1, metavar="INTS", negative=())]
Names = Annotated[tuple[str, ...], Parameter(converter=_outputs, n_tokens=1, metavar="NAMES", negative=())]
Patterns = Annotated[
    tuple[str, ...], Parameter(converter=_patterns, n_tokens=1, metavar="PATTERN", negative=())
]
Time = Annotated[float, Parameter(metavar="SECONDS")]
Flag = Annotated[bool, Parameter(show_default=False)]


def without_settings(*names: str) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Decorate a command for which these settings make no sense: `with_scene_options` leaves them out."""

    def mark(command: Callable[..., int]) -> Callable[..., int]:
        command.__dict__["settings_left_out"] = frozenset(names)
        return command

    return mark


def with_scene_options(command: Callable[..., int], plugin: ScenePlugin) -> Callable[..., int]:
    """`command` with an option for each setting and each parameter of a scene.

    See `scene_options` for the names of a scene's.

    Parameters
    ----------
    command : callable
        Takes ``settings`` and ``parameters``, dicts of what was given, as keyword arguments.
    plugin : ScenePlugin

    Raises
    ------
    SceneError
        If two parameters would have the same option.
    """
    signature = inspect.signature(command, eval_str=True)
    own = [p for p in signature.parameters.values() if p.name not in ("settings", "parameters")]
    left_out: frozenset[str] = getattr(command, "settings_left_out", frozenset())
    added = _settings_options(left_out) + _scene_parameters(plugin)

    @functools.wraps(command)
    def run(*arguments: Any, **options: Any) -> int:
        settings, parameters, rest = {}, {}, {}
        preset: str | None = None
        for name, value in options.items():
            kind, _, bare = name.partition("__")
            if name == "settings__preset":
                preset = value
            elif kind == "settings":
                settings[bare] = value
            elif kind == "parameters":
                parameters[bare] = value
            else:
                rest[name] = value
        if preset is not None:
            bounds = [name for name in ("max_error", "max_codes", "budget_ms") if rest.get(name) is not None]
            if bounds:
                option = bounds[0].replace("_", "-")
                raise SettingsError(f"--preset and --{option} both choose settings: leave one of them out")
            chosen = preset_with(preset, settings)
            settings = {name: value for name, value in chosen.items() if name not in left_out}
        return command(*arguments, settings=settings, parameters=parameters, **rest)

    run.__signature__ = signature.replace(parameters=own + added)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in own + added}
    return run


def scene_options(plugin: ScenePlugin) -> list[str]:
    """The option of each of a scene's parameters, the same in all commands, for example ``--fireflies``.

    A parameter whose name is that of another option of any command, say "size", has ``--scene-size``.

    Raises
    ------
    SceneError
        If two parameters would have the same option.
    """
    taken = COMMAND_OPTIONS | {field.name for field in fields(Settings)}
    names: list[str] = []
    for p in plugin.parameters:
        name = f"scene_{p.name}" if p.name in taken else p.name
        if name in taken or name in names:
            raise SceneError(
                f"scene {plugin.name!r}: parameter {p.name!r} needs another name, it occurs twice"
            )
        names.append(name)
    return ["--" + name.replace("_", "-") for name in names]


def _option(key: str, name: str, hint: Any, about: str, default: str, group: Group) -> inspect.Parameter:
    """A keyword `key` that is absent unless its option is given; `default` is what the help shows."""
    option = Parameter(
        name=name,
        help=about,
        group=group,
        show_default=lambda _: default,
        negative=None if hint is bool and default == "True" else (),
    )
    return inspect.Parameter(
        key,
        inspect.Parameter.KEYWORD_ONLY,
        default=None,
        annotation=Annotated[Whole if hint is int else hint, option],
    )


def _settings_options(left_out: frozenset[str]) -> list[inspect.Parameter]:
    group = Group("Settings", sort_key=1)
    hints = get_type_hints(Settings)
    about = "Settings that go together, of which others that are given change some."
    options = [_option("settings__preset", "--preset", Literal[tuple(PRESETS)], about, "balanced", group)]
    for field in fields(Settings):
        if field.name in left_out:
            continue
        # an optional choice may itself be called "none": keep None out of the hint
        choices = [part for part in get_args(hints[field.name]) if part is not type(None)]
        hint = choices[0] if len(choices) == 1 else hints[field.name]
        default = _SETTINGS_DEFAULT.get(field.name, str(field.default))
        about = SETTINGS_HELP[field.name]
        name = "--" + field.name.replace("_", "-")
        options.append(_option(f"settings__{field.name}", name, hint, about, default, group))
    return options


def _scene_parameters(plugin: ScenePlugin) -> list[inspect.Parameter]:
    group = Group(f"Scene {plugin.name}", sort_key=2)
    return [
        _option(f"parameters__{p.name}", name, p.type, parameter_help(p), str(p.default), group)
        for p, name in zip(plugin.parameters, scene_options(plugin), strict=True)
    ]


def parameter_help(parameter: SceneParameter) -> str:
    """A parameter's help with its range and unit, for example "Its height (between 0 and 9 units)."."""
    ranged = parameter.minimum is not None or parameter.maximum is not None
    about = " ".join(part for part in (parameter.range_text() if ranged else "", parameter.unit) if part)
    return f"{parameter.help.rstrip('.')} ({about})." if about else parameter.help
