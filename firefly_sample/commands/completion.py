"""``firefly completion``: a script for a shell, which completes what the command line may have next."""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from firefly_sample.commands.terminal import print_result

if TYPE_CHECKING:
    from firefly_sample.scene.scene import ScenePlugin


def completion(shell: Annotated[Literal["bash", "zsh", "fish"], Parameter(metavar="SHELL")]) -> int:
    """Print a script that completes commands, options and scenes in a shell.

    To use it in all future shells, write it to the file in which the shell looks for it, for example::

        firefly completion bash > ~/.local/share/bash-completion/completions/firefly
        firefly completion zsh > ~/.zsh/completions/_firefly    (a folder of $fpath)
        firefly completion fish > ~/.config/fish/completions/firefly.fish

    Parameters
    ----------
    shell
        The shell.
    """
    from firefly_sample.cli import COMMANDS, make_app
    from firefly_sample.scenes import list_scenes

    print_result(make_app(COMMANDS, [], merged(list_scenes())).generate_completion(shell=shell))
    return 0


def merged(plugins: Iterable[ScenePlugin]) -> Any:
    """Return a stand-in for a scene plugin, with the parameters of all `plugins`."""
    parameters = {parameter.name: parameter for plugin in plugins for parameter in plugin.parameters}
    return SimpleNamespace(name="", parameters=tuple(parameters.values()))
