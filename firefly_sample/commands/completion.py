"""``firefly completion``: a script with which a shell completes command lines."""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Literal

from firefly_sample.commands.terminal import print_result

if TYPE_CHECKING:
    from firefly_sample.scene.scene import ScenePlugin

_BASH = "complete -F _firefly firefly"
_BASH_WITH_FILES = "complete -o filenames -o default -F _firefly firefly"
"""Folders get no space after them, and where the script has nothing to offer, bash offers files."""


def completion(shell: Literal["bash", "zsh", "fish"], /) -> int:
    """Print a script that completes commands, options and scenes in a shell.

    For all future shells, write it to the file in which the shell looks for it:

    bash: firefly completion bash > ~/.local/share/bash-completion/completions/firefly

    zsh: firefly completion zsh > _firefly, in a folder of $fpath

    fish: firefly completion fish > ~/.config/fish/completions/firefly.fish

    Parameters
    ----------
    shell
        The shell to print it for.
    """
    from firefly_sample.cli import COMMANDS, make_app
    from firefly_sample.scenes import list_scenes

    script = make_app(COMMANDS, [], merged(list_scenes())).generate_completion(shell=shell)
    print_result(script.replace(_BASH, _BASH_WITH_FILES))
    return 0


def merged(plugins: Iterable[ScenePlugin]) -> Any:
    """Return a stand-in for a scene plugin, with the parameters of all `plugins`."""
    parameters = {parameter.name: parameter for plugin in plugins for parameter in plugin.parameters}
    return SimpleNamespace(name="", parameters=tuple(parameters.values()))
