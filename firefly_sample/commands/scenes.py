"""``firefly scenes``: the installed scenes."""

from __future__ import annotations

import shutil
import sys

from firefly_sample.columns import align
from firefly_sample.commands.options import Flag, parameter_help, scene_options
from firefly_sample.commands.terminal import print_json, print_result

_KEYS = ("name", "type", "default", "minimum", "maximum", "choices", "unit", "live", "help")


def scenes(*, json: Flag = False) -> int:
    """List the installed scenes and their parameters.

    Parameters
    ----------
    json
        Print JSON.
    """
    from firefly_sample.scenes import list_scenes

    plugins = list_scenes()
    if json:
        print_json(
            [
                {
                    "name": plugin.name,
                    "summary": plugin.summary,
                    "parameters": [
                        {key: getattr(parameter, key) for key in _KEYS} | {"type": parameter.type.__name__}
                        for parameter in plugin.parameters
                    ],
                }
                for plugin in plugins
            ]
        )
        return 0
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    lines = []
    for plugin in plugins:
        lines.append(f"{plugin.name}: {plugin.summary}")
        rows = [
            (f"  {option}", str(p.default), parameter_help(p)) for option, p in scene_options(plugin).items()
        ]
        if rows:
            lines.append(align(rows, width))
    print_result("\n".join(lines))
    return 0
