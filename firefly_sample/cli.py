"""The command ``firefly``.

Results go to stdout, everything else to stderr. The exit code is 0 after success, 1 after an error (which is
one line), 2 if the command line or the configuration is wrong, 3 if some frames of a capture could not be
drawn, 130 after Ctrl-C, 143 after SIGTERM, 129 after SIGHUP. It is no error if the reader of a pipe closes it
early.

Libraries that take long are imported late, when the handlers of signals are in place.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Collection, Sequence
from contextlib import ExitStack
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

from firefly_sample.commands import signals
from firefly_sample.commands.terminal import check_stdout, complain, safe_streams
from firefly_sample.errors import FireflyError

if TYPE_CHECKING:
    from cyclopts import App

    from firefly_sample.commands.configuration import Table, Words
    from firefly_sample.scene.scene import ScenePlugin

COMMANDS: dict[Words, str] = {
    ("capture",): "Render frames of a scene to files.",
    ("verify",): "Check that a capture is whole, or compare it with another one.",
    ("run",): "Open a window on a scene.",
    ("plan",): "Show the passes and targets of a frame, and why each is needed.",
    ("measure", "speed"): "Time frames with more and more lights, by each method of drawing them.",
    ("measure", "start"): "Time how soon the first picture is drawn, with a cache and without.",
    ("measure", "pyrender"): "Time frames of pyrender's scenes, drawn here and by pyrender.",
    ("measure", "panda3d"): "Time frames of a live Panda3D program, and of its scene alone.",
    ("measure", "fireflies"): "Draw Panda3D's sample fireflies by Panda3D and here, side by side.",
    ("measure", "captures"): "Time captures by one process, by workers, and by a cluster.",
    ("measure", "trade"): "Measure what each setting costs in time and in accuracy.",
    ("measure", "stability"): "Draw numerically extreme scenes, and compare each error with its bound.",
    ("measure", "numerics"): "Measure what number formats and formulas lose on this driver.",
    ("doctor",): "Show driver, devices and versions, and how to install missing parts.",
    ("scenes",): "List the installed scenes and their parameters.",
    ("completion",): "Print a script that completes commands, options and scenes in a shell.",
}
WITH_SCENE = (("capture",), ("run",), ("plan",), ("measure", "speed"), ("measure", "trade"))
"""Commands that have an option for each parameter of a scene."""
_OPERANDS: dict[Words, str] = {
    **dict.fromkeys((*WITH_SCENE, ("measure", "start"), ("measure", "captures")), "[SCENE | FILE...] "),
    ("verify",): "FOLDER [OTHER] ",
    ("measure", "fireflies"): "FOLDER ",
    ("measure", "numerics"): "[TABLE...] ",
    ("completion",): "SHELL ",
}
_FULL_HELP = "--help-all"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code; errors are printed, not raised.

    `arguments` are those of the process if absent, without the program's name.
    """
    ending = signals.unhandled() if arguments is None else ()
    signals.end_at_once(ending)
    if os.environ.get("COLUMNS") == "0":  # as in some containers; help cannot be that narrow
        del os.environ["COLUMNS"]
    tokens = list(sys.argv[1:] if arguments is None else arguments)
    with safe_streams(), warnings.catch_warnings():
        if not sys.warnoptions:  # -W and PYTHONWARNINGS take precedence
            warnings.simplefilter("once", UserWarning)
        warnings.showwarning = lambda message, *_: complain(f"warning: {message}")
        try:
            code = _guarded(tokens, ending)
        except KeyboardInterrupt as error:
            signals.ignore(ending)  # one line is enough
            word, code = signals.outcome(error)
            complain(word)
        finally:
            signals.reset(ending)  # only the end of the process is left
    return code


def _guarded(tokens: list[str], ending: Sequence[int]) -> int:
    """Run a command line and return its exit code; any error becomes one line, but not KeyboardInterrupt."""
    try:
        code = _run(tokens, ending)
        check_stdout()
    except (FireflyError, Warning) as error:  # -W error makes warnings errors
        complain(str(error))
        code = 1
    except MemoryError as error:
        complain(f"out of memory: {error or 'the system has no more'}; a smaller picture takes less")
        code = 1
    except OSError as error:
        where = f"{error.filename}: " if error.filename is not None else ""
        complain(f"{where}{error.strerror or error}")
        code = 1
    except SystemExit as error:
        complain(f"sys.exit({error.code!r}) was called before the command was done")
        code = 1
    return code


def _run(tokens: list[str], ending: Sequence[int]) -> int:
    from cyclopts import CycloptsError

    from firefly_sample.commands.configuration import error_text, read_configuration

    if tokens[:1] == ["__complete"]:  # by the script of firefly completion
        from firefly_sample.commands.completion import merged

        make_app({_words(tokens[1:])}, [], merged([]))(tokens, result_action="return_value")
        return 0
    words = _words(tokens)
    tables: list[Table] = []
    try:
        tables = read_configuration(COMMANDS)
        plugin = scene_of(words, tokens, tables) if words in WITH_SCENE else None
        command = parse(words, tokens, tables, plugin)
        signals.interrupt(ending)
        with ExitStack() as stack:
            if plugin is not None:
                from firefly_sample.scenes import naming

                stack.enter_context(naming(plugin))
            result = command()
    except CycloptsError as error:
        error.verbose = False
        complain(error_text(error, tables, words))
        return 2
    return result if isinstance(result, int) else 0


def _words(tokens: Sequence[str]) -> Words:
    """Return the words of the command that `tokens` begin with; none if there is no such command."""
    return next((words for words in COMMANDS if tuple(tokens[: len(words)]) == words), ())


def parse(
    words: Words, tokens: list[str], tables: list[Table], plugin: ScenePlugin | None
) -> Callable[[], object]:
    """Return the function that the command line asks for, ready to be called."""
    app = make_app({words}, tables, plugin, full_help=_FULL_HELP in tokens)
    command, bound, _ = app.parse_args(tokens, exit_on_error=False, print_error=False)
    return partial(command, *bound.args, **bound.kwargs)


def scene_of(words: Words, tokens: list[str], tables: list[Table]) -> ScenePlugin:
    """Return the scene whose options `tokens` may use.

    The word after the command is the scene, unless it is an option. Otherwise the configuration may name the
    scene, or it follows options, which are parsed with the default scene or the configuration's. If that
    fails, the first word that ends like a model's file is the scene.
    """
    from cyclopts import CycloptsError

    from firefly_sample.commands.options import DEFAULT_SCENE
    from firefly_sample.scenes import find_scene
    from firefly_sample.scenes.files import has_model_suffix

    rest = tokens[len(words) :]
    if rest and not rest[0].startswith("-"):
        return find_scene(rest[0])
    name = DEFAULT_SCENE
    for known in (words, tokens):
        app = make_app({words}, tables, find_scene(name), allow_unknown=True)
        try:
            _, bound, *_ = app.parse_known_args(known)
        except CycloptsError:
            # `parse` raises the error, unless options of the scene come before it
            name = next((token for token in tokens if has_model_suffix(token) and token[0] != "-"), name)
            break
        name = bound.arguments.get("scene", name)
    return find_scene(name)


def make_app(
    chosen: Collection[Words],
    tables: list[Table],
    plugin: ScenePlugin | None = None,
    allow_unknown: bool = False,
    full_help: bool = True,
) -> App:
    """Return the command line, in which commands that are not chosen have only a name and a summary."""
    from cyclopts import App, Group, Parameter

    from firefly_sample.commands.configuration import as_sources

    app = App(
        name="firefly",
        help="Many lights, deferred, measured: a night forest with hundreds of fireflies.",
        help_format="plaintext",
        version=lambda: str(import_module("firefly_sample").__version__),
        default_parameter=Parameter(negative=()),
        group_parameters=Group("Options", sort_key=0),
        config=as_sources(tables, allow_unknown),
        suppress_keyboard_interrupt=False,
    )
    groups = {(): app, ("measure",): App(name="measure", help="Measure the cost and the accuracy of frames.")}
    app.command(groups["measure",])
    for words, summary in COMMANDS.items():
        if words not in chosen:
            groups[words[:-1]].command(App(name=words[-1], help=summary))
            continue
        name = f"firefly {' '.join(words)}"
        options: dict[str, Any] = {"usage": f"Usage: {name} {_OPERANDS.get(words, '')}[OPTIONS]"}
        if words in WITH_SCENE:
            options["help_flags"] = (*app.help_flags, _FULL_HELP)
            if not full_help:
                epilogue = f"{name} SCENE {_FULL_HELP} shows all options, also those of settings."
                options["help_epilogue"] = epilogue
        groups[words[:-1]].command(_load(words, plugin, full_help, allow_unknown), name=words[-1], **options)
    return app


def _load(
    words: Words, plugin: ScenePlugin | None, full_help: bool, allow_unknown: bool
) -> Callable[..., int]:
    """Return the function of a command, with the options of a scene if it takes one."""
    module = import_module(f"firefly_sample.commands.{'_'.join(words)}")
    command: Callable[..., int] = getattr(module, words[-1])
    command.__doc__ = _unwrapped(command.__doc__ or "")
    if plugin is None or words not in WITH_SCENE:
        return command

    from firefly_sample.commands.options import with_scene_options

    return with_scene_options(command, plugin, full_help, allow_unknown)


def _unwrapped(text: str) -> str:
    """Return a docstring with each paragraph, and each description of a parameter, on one line."""
    import inspect

    lines: list[str] = []
    for line in inspect.cleandoc(text).splitlines():
        indent = len(line) - len(line.lstrip())
        goes_on = lines and line and lines[-1] and "Parameters" not in lines
        if goes_on or (indent and lines[-1].startswith(" ")):
            lines[-1] += f" {line.lstrip()}"
        else:
            lines.append(line)
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
