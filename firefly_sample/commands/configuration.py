"""The configuration in the working folder: firefly.toml, and the table [tool.firefly] of pyproject.toml."""

from __future__ import annotations

import os
import stat
import warnings
from collections.abc import Collection, Iterable
from typing import Any, NamedTuple

from cyclopts import App, ArgumentCollection, CycloptsError, UnknownOptionError
from cyclopts.config import Dict, Env

from firefly_sample.errors import did_you_mean

__all__ = ["Table", "as_sources", "named_by_table", "read_configuration"]

_LARGEST = 2**20
"""Bytes: no configuration is larger."""
_LOST = (
    "{} belongs to no command: options stand in tables such as [firefly.capture] or [tool.firefly.capture]"
)

Words = tuple[str, ...]


class Table(NamedTuple):
    """A file's table of options.

    Attributes
    ----------
    path : str
        The file.
    keys : tuple of str
        Where the table is in it.
    content : dict
        The whole file.
    """

    path: str
    keys: tuple[str, ...]
    content: dict[str, Any]


def read_configuration(commands: Collection[Words]) -> list[Table]:
    """Read both files, as far as they are there.

    A pyproject.toml belongs to whatever project the working folder is of: where it cannot be read, and does
    not hold the word firefly, a warning says so and it is left out.

    Parameters
    ----------
    commands : collection of tuple of str
        The words of every command: what may have a table of options.

    Raises
    ------
    CycloptsError
        If a file cannot be read, is not TOML, or has a table that belongs to no command; it names the file.
    """
    tables = []
    for name, keys, ours in (
        ("firefly.toml", ("firefly",), True),
        ("pyproject.toml", ("tool", "firefly"), False),
    ):
        try:
            data = _bytes_of(name)
        except PermissionError as error:
            if not _can_search():
                warnings.warn(
                    f"no configuration is read: the working folder cannot be searched ({error.strerror})",
                    stacklevel=2,
                )
                break
            _refuse(name, error.strerror or "permission denied", ours)
        except OSError as error:
            _refuse(name, error.strerror or str(error), ours)
        else:
            if data is None:
                continue
            import tomllib

            try:
                content = tomllib.loads(data.decode())
            except (ValueError, RecursionError) as error:
                _refuse(name, f"it is not TOML: {error}", ours or b"firefly" in data)
            else:
                if ours and (others := sorted(set(content) - {keys[0]})):
                    raise CycloptsError(f"{_path(name)}: {_LOST.format(others[0])}")
                table = _inner(content, keys)
                if table is not None:
                    _check_table(_path(name), keys, table, commands)
                    tables.append(Table(_path(name), keys, content))
    return tables


def as_sources(tables: Iterable[Table], allow_unknown: bool) -> list[Env | Dict]:
    """The environment and the tables as cyclopts takes them; what comes first counts."""
    environment = Env if allow_unknown else _Environment
    return [
        environment("FIREFLY_", show=False),
        *(
            Dict(table.content, source=table.path, root_keys=table.keys, allow_unknown=allow_unknown)
            for table in tables
        ),
    ]


class _Environment(Env):
    """Environment variables as options, with a warning for each that is named like one and is none."""

    def __call__(self, app: App, commands: Words, arguments: ArgumentCollection) -> None:
        super().__call__(app, commands, arguments)
        if not commands:
            return
        prefix = "_".join(("FIREFLY", *commands, "")).upper()
        options = {name.lstrip("-") for argument in arguments for name in argument.names}
        known = [prefix + name.replace("-", "_").upper() for name in options]
        for variable in sorted(os.environ):
            if variable.startswith(prefix) and variable not in known:
                close = did_you_mean(variable, known)
                text = f"{variable} names no option of firefly {' '.join(commands)} with this scene{close}"
                warnings.warn(text, stacklevel=2)


def named_by_table(error: CycloptsError, tables: Iterable[Table], words: Words) -> str:
    """The text of an error; a key of a file is called by its table and its file."""
    text, token = str(error), getattr(error, "token", None)
    for table in tables:
        if token is None or token.source != table.path or not token.keyword:
            continue
        start = "".join(f"[{key}]" for key in table.keys)
        key = token.keyword.removeprefix(start)[1:-1].replace("][", ".")
        place = f"{key!r} in [{'.'.join((*table.keys, *words))}] of {table.path}"
        if isinstance(error, UnknownOptionError):
            known = [name.removeprefix("--") for option in error.argument_collection for name in option.names]
            return f"Unknown option: {place}{did_you_mean(key, known)}"
        text = text.replace(token.keyword, place)
    return text


def _bytes_of(name: str) -> bytes | None:
    """A file's bytes, None if there is none; never waits, as for the writer of a pipe."""
    try:
        handle = os.open(name, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        if os.path.islink(name):
            raise OSError("it is a link to what does not exist") from None
        return None
    try:
        mode = os.fstat(handle).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISCHR(mode)):  # a character device: /dev/null, say
            raise OSError("it is not a file")
        data = b""
        while part := os.read(handle, _LARGEST):
            data += part
            if len(data) > _LARGEST:
                raise OSError(f"it has more than {_LARGEST} bytes")
        return data
    finally:
        os.close(handle)


def _can_search() -> bool:
    try:
        os.stat("firefly.toml")
    except PermissionError:
        return False
    except OSError:
        pass
    return True


def _refuse(name: str, reason: str, ours: bool) -> None:
    """Say why a file is not read: an error if it is, or may be, our configuration."""
    text = f"{_path(name)} cannot be read: {reason}"
    if ours:
        raise CycloptsError(text)
    warnings.warn(f"{text}; it is ignored", stacklevel=3)


def _inner(content: Any, keys: tuple[str, ...]) -> Any:
    """What stands under `keys`; None if nothing does."""
    for key in keys:
        content = content.get(key) if isinstance(content, dict) else None
    return content


def _check_table(
    path: str,
    keys: tuple[str, ...],
    table: object,
    commands: Collection[Words],
    words: Words = (),
) -> None:
    """Raise if a table is none, or holds what no command would ever read: of its own table each decides."""
    if not isinstance(table, dict):
        place = ".".join((*keys, *words))
        raise CycloptsError(f"{path}: {place} must be a table, [{place}], got {table!r}")
    if words in commands:
        return
    for key, value in table.items():
        inner = (*words, key)
        if not any(known[: len(inner)] == inner for known in commands):
            raise CycloptsError(f"{path}: {_LOST.format('.'.join((*keys, *inner)))}")
        _check_table(path, keys, value, commands, inner)


def _path(name: str) -> str:
    try:
        return os.path.abspath(name)
    except OSError:  # the working folder is gone
        return name
