"""The command ``firefly``.

Results go to stdout, everything else to stderr. The exit code is 0, 1 after an error (one line says what),
2 after a command line that cannot be understood, 130 after Ctrl-C.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from cyclopts import App, CycloptsError, Parameter
from cyclopts.config import Env, Toml

from firefly_sample.commands.terminal import complain
from firefly_sample.errors import FireflyError

if TYPE_CHECKING:
    from firefly_sample.scene.scene import ScenePlugin

__all__ = ["main"]

Words = tuple[str, ...]

_COMMANDS: dict[Words, str] = {
    ("capture",): "Render frames of a scene to files.",
    ("run",): "Open a window on a scene.",
    ("plan",): "Show the passes and targets of a frame, and what asked for each.",
    ("measure", "speed"): "Time frames with more and more lights, by each method of drawing them.",
    ("measure", "start"): "How soon the first picture is there, with a cache and without.",
    ("measure", "trade"): "What each setting costs in time and in error.",
    ("measure", "stability"): "Draw numerical extremes, and hold each to its bound.",
    ("measure", "numerics"): "What numbers lose on this driver: the figures that the defaults rest on.",
    ("doctor",): "Show driver, devices and versions, and how to install what is missing.",
    ("scenes",): "List the installed scenes and their parameters.",
}
_WITHOUT_SCENE = (
    ("measure", "start"),
    ("measure", "stability"),
    ("measure", "numerics"),
    ("doctor",),
    ("scenes",),
)
_OPERANDS: dict[Words, str] = {("measure", "numerics"): "[TABLE...] ", ("measure", "start"): "[SCENE] "}
_WITH_SCENE = [words for words in _COMMANDS if words not in _WITHOUT_SCENE]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and give its exit code; errors are printed, not raised.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process when absent.
    """
    tokens = list(sys.argv[1:] if arguments is None else arguments)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("once", UserWarning)
            warnings.showwarning = lambda message, *_: complain(f"warning: {message}")
            code = _run(tokens)
        sys.stdout.flush()
    except CycloptsError as error:
        error.verbose = False
        complain(str(error))
        return 2
    except FireflyError as error:
        complain(str(error))
        return 1
    except KeyboardInterrupt:
        complain("interrupted")
        return 130
    except BrokenPipeError:
        # the reader (head, less) has seen enough; the interpreter must not complain when it flushes again
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code


def _run(tokens: list[str]) -> int:
    words = next((words for words in _COMMANDS if tuple(tokens[: len(words)]) == words), ())
    app = _app(words, _scene_of(words, tokens) if words in _WITH_SCENE else None)
    result = app(tokens, result_action="return_value", exit_on_error=False, print_error=False)
    return result if isinstance(result, int) else 0


def _scene_of(words: Words, tokens: list[str]) -> ScenePlugin:
    """The scene whose options `tokens` may use.

    What directly follows the command, if it is no option, is the scene. Otherwise the configuration may
    name it, or it comes later and is found with the options of the scene that would be drawn without it.
    """
    from firefly_sample.commands.options import DEFAULT_SCENE
    from firefly_sample.scenes import find_scene

    rest = tokens[len(words) :]
    if rest and not rest[0].startswith("-"):
        return find_scene(rest[0])
    name = DEFAULT_SCENE
    for known in (words, tokens):
        try:
            _, bound, *_ = _app(words, find_scene(name), allow_unknown=True).parse_known_args(known)
        except CycloptsError:
            break  # the real parse says what is wrong
        name = bound.arguments.get("scene", name)
    return find_scene(name)


def _app(chosen: Words, plugin: ScenePlugin | None = None, allow_unknown: bool = False) -> App:
    """The whole command line, of which only the chosen command is more than its name and summary."""
    app = App(
        name="firefly",
        help="Many lights, deferred, measured: a night forest with hundreds of fireflies.",
        help_format="plaintext",
        version=_version,
        default_parameter=Parameter(negative=()),
        config=[
            Env("FIREFLY_", show=False),
            Toml("firefly.toml", root_keys=("firefly",), allow_unknown=allow_unknown),
            Toml("pyproject.toml", root_keys=("tool", "firefly"), allow_unknown=allow_unknown),
        ],
        suppress_keyboard_interrupt=False,
    )
    groups = {
        (): app,
        ("measure",): App(name="measure", help="What frames cost, how far they are off, and what holds."),
    }
    app.command(groups["measure",])
    for words, summary in _COMMANDS.items():
        if words == chosen:
            operands = "[SCENE] " if plugin else _OPERANDS.get(words, "")
            usage = f"Usage: firefly {' '.join(words)} {operands}[OPTIONS]"
            groups[words[:-1]].command(_load(words, plugin), name=words[-1], usage=usage)
        else:
            groups[words[:-1]].command(App(name=words[-1], help=summary))
    return app


def _load(words: Words, plugin: ScenePlugin | None) -> Callable[..., int]:
    """The function of a command, with the options of a scene if it takes one."""
    command: Callable[..., int] = getattr(
        import_module(f"firefly_sample.commands.{'_'.join(words)}"), words[-1]
    )
    if plugin is None:
        return command

    from firefly_sample.commands.options import with_scene_options

    return with_scene_options(command, plugin)


def _version() -> str:
    from firefly_sample import __version__

    return __version__


if __name__ == "__main__":
    sys.exit(main())
