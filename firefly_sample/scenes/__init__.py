"""Scene plugins: found by the name of an entry point, as ``package.module:object``, or as a model's file."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from functools import lru_cache, partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

from firefly_sample.errors import FireflyError, SceneError, SceneNotFoundError, did_you_mean
from firefly_sample.scene.parameter import resolve_parameters
from firefly_sample.scenes.files import check_file, is_file_name, similar_file, split_files

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from firefly_sample.scene.scene import Scene, ScenePlugin

ENTRY_POINT_GROUP = "firefly_sample.scenes"
"""The group of entry points for scenes."""
_NOT_A_PLUGINS = sys.stdlib_module_names | {__name__.partition(".")[0]}
_being_named: list[set[str]] = []
"""For each block of `naming` that is open: the modules of the classes of the scenes that were built in it."""


def find_scene(name: str) -> ScenePlugin:
    """Return the scene plugin that is called `name`.

    Parameters
    ----------
    name : str
        The name of an entry point of the group ``firefly_sample.scenes``, for example "forest";
        "package.module:object" for any importable object; or a model's file, or several with commas between
        them. If a file has the name of a scene, the scene is meant, and ``./forest`` is the file.

    Raises
    ------
    ModelError
        If the name is that of a file, which is missing.
    SceneNotFoundError
        If there is no such scene, or it cannot be imported; the message lists the installed ones.
    SceneError
        If its module raises something else while it is imported (the message says what and where), or what
        was found is not a scene plugin.
    """
    installed = _entry_points()
    if name in installed:
        return _named(installed[name])
    files = split_files(name)
    if files and all(is_file_name(file) for file in files):
        from firefly_sample.scenes.model import file_plugin

        return file_plugin(name)
    if ":" in name:
        return _load(name, name)
    if os.path.isdir(name):
        check_file(name)
    what = "scene or file" if os.path.splitext(name)[1] else "scene"
    raise SceneNotFoundError(
        f"there is no {what} {name!r}{similar_file(name) or did_you_mean(name, installed)}; installed: "
        f"{', '.join(installed) or 'none'}; others are given as package.module:object, models as files"
    )


def list_scenes() -> list[ScenePlugin]:
    """Return every installed scene plugin, sorted by name.

    Raises
    ------
    SceneError
        If one of them cannot be loaded; the message names it.
    """
    return [_named(entry) for entry in _entry_points().values()]


def build_scene(plugin: ScenePlugin, /, **given: Any) -> Scene:
    """Build a new scene of `plugin`, with its defaults for the parameters that are not given.

    Raises
    ------
    ParameterError
        If a given parameter does not exist or has a wrong value.
    SceneError
        If the plugin's `build` raises what is not a `FireflyError`, or gives what is not a `Scene`; the
        message says what and where.
    """
    from firefly_sample.scene.scene import Scene

    resolved = resolve_parameters(plugin.name, plugin.parameters, given)
    try:
        built: object = plugin.build(**resolved)
    except (FireflyError, KeyboardInterrupt):
        raise
    except BaseException as error:  # SystemExit, too
        fault = _fault(error, _modules(plugin))
        raise SceneError(f"scene {plugin.name!r}: build() failed: {fault}") from error
    if not isinstance(built, Scene):
        code = getattr(plugin.build, "__code__", None)
        where = f" ({code.co_filename}:{code.co_firstlineno})" if code is not None else ""
        raise SceneError(
            f"scene {plugin.name!r}: build() must give a Scene, got {type(built).__name__}{where}"
        )
    for modules in _being_named:
        modules.add(type(built).__module__)
    return built


@contextmanager
def naming(plugin: ScenePlugin) -> Iterator[None]:
    """Raise a `SceneError` that names `plugin`, and the place, for what its own code raises in a block.

    An error that no code of the plugin's package had a part in stays as it is, as does a `FireflyError`.
    """
    built: set[str] = set()
    _being_named.append(built)
    try:
        yield
    except (FireflyError, KeyboardInterrupt):
        raise
    except BaseException as error:  # SystemExit, too
        named = scene_error(plugin, error, built)
        if named is None:
            raise
        raise named from error
    finally:
        _being_named.pop()


def scene_error(plugin: ScenePlugin, error: BaseException, modules: Collection[str]) -> SceneError | None:
    """Return an error that names `plugin` and the place for what its own code raised, on one line.

    None if no code of the plugin's package had a part in it. `modules` are those of its scenes' classes.
    """
    packages = {name.partition(".")[0] for name in _modules(plugin).union(modules)} - _NOT_A_PLUGINS
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    names = {name for frame in frames if (name := frame.f_globals.get("__name__", ""))}
    own = {name for name in names if name.partition(".")[0] in packages}
    return SceneError(f"scene {plugin.name!r}: {_fault(error, own)}") if own else None


def _modules(plugin: ScenePlugin) -> set[str]:
    """Return the modules of a plugin's class and of its function `build`."""
    build: Any = plugin.build
    while isinstance(build, partial):
        build = build.func
    return {type(plugin).__module__, getattr(build, "__module__", None) or ""}


def _fault(error: BaseException, modules: set[str]) -> str:
    """Describe what a plugin raised, on one line, and where: the innermost frame in one of its modules."""
    text = str(error)
    places = [
        f"{frame.f_code.co_filename}:{line}"
        for frame, line in traceback.walk_tb(error.__traceback__)
        if frame.f_globals.get("__name__") in modules
    ]
    if isinstance(error, SyntaxError) and error.filename and not error.filename.startswith("<"):
        # the module that does not compile has no frame, and the text would repeat the place
        text, places = error.msg, [f"{error.filename}:{error.lineno}"]
    name = "sys.exit was called" if isinstance(error, SystemExit) else type(error).__name__
    text = " ".join(text.split())
    said = f"{name}: {text}" if text else name
    return f"{said} ({places[-1]})" if places else said


def _entry_points() -> dict[str, EntryPoint]:
    """Return the installed scenes by name, sorted."""
    return _entry_points_in(tuple(map(_folder, sys.path)))


def _folder(path: str) -> tuple[int, int, int] | None:
    """Return what changes when a package is installed in a folder or removed from it; None without one."""
    try:
        found = os.stat(path or os.curdir)
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_mtime_ns


@lru_cache(maxsize=1)
def _entry_points_in(folders: tuple[tuple[int, int, int] | None, ...]) -> dict[str, EntryPoint]:
    """Return the installed scenes, read again when `folders` change.

    A command asks several times, and each reading opens the files of all installed packages.
    """
    from importlib.metadata import entry_points

    found: dict[str, EntryPoint] = {}
    for entry in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda entry: entry.name):
        other = found.setdefault(entry.name, entry)
        if other.value != entry.value:
            raise SceneError(
                f"two packages bring a scene {entry.name!r}, {other.value} and {entry.value}: uninstall one"
            )
    return found


def _named(entry: EntryPoint) -> ScenePlugin:
    plugin = _load(entry.name, entry.value)
    if plugin.name != entry.name:
        raise SceneError(
            f"scene {entry.name!r} calls itself {plugin.name!r}: "
            "the name of its entry point and its attribute 'name' must agree"
        )
    return plugin


def _load(name: str, value: str) -> ScenePlugin:
    """Load the plugin at `value`, "package.module:object", that was asked for as `name`."""
    module_name, _, attribute = value.partition(":")
    if not all(part.isidentifier() for part in (*module_name.split("."), attribute)):
        raise SceneNotFoundError(f"scene {name!r}: {value!r} is not of the form package.module:object")
    try:
        module = import_module(module_name)
    except ImportError as error:
        raise SceneNotFoundError(
            f"scene {name!r}: {module_name} cannot be imported: {error}; "
            "is its package installed, or its folder in PYTHONPATH?"
        ) from error
    except (FireflyError, KeyboardInterrupt):
        raise
    except BaseException as error:  # SystemExit, too
        fault = _fault(error, {module_name})
        raise SceneError(f"scene {name!r}: {module_name} cannot be imported: {fault}") from error
    plugin: ScenePlugin | None = getattr(module, attribute, None)
    if plugin is None:
        raise SceneNotFoundError(f"scene {name!r}: {module_name} has no {attribute!r}")
    missing = [part for part in ("name", "summary", "parameters", "build") if not hasattr(plugin, part)]
    if missing:
        raise SceneError(
            f"{value} is not a scene plugin, which has name, summary, parameters and build: "
            f"it has no {', '.join(missing)}"
        )
    return plugin
