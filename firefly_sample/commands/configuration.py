"""The configuration in the working folder: firefly.toml, and the table [tool.firefly] of pyproject.toml."""

from __future__ import annotations

import os
import stat
import warnings
from collections.abc import Collection, Iterable
from typing import Any, NamedTuple

from cyclopts import App, ArgumentCollection, CycloptsError, UnknownOptionError
from cyclopts.config import Dict, Env

from firefly_sample.errors import RENAMED, did_you_mean

_OURS = "firefly.toml"
_LARGEST = 2**20
"""Bytes: no configuration is larger."""
_NO_COMMAND = (
    "{} belongs to no command: options belong in tables such as [firefly.capture] or [tool.firefly.capture]"
)

Words = tuple[str, ...]


class Table(NamedTuple):
    """A file's table of options.

    Attributes
    ----------
    path : str
        The file.
    keys : tuple of str
        The keys that lead to the table.
    content : dict
        The whole file.
    """

    path: str
    keys: tuple[str, ...]
    content: dict[str, Any]


def read_configuration(commands: Collection[Words]) -> list[Table]:
    """Read both files, if they exist.

    A pyproject.toml may belong to any project: if it cannot be read and does not contain the word firefly, it
    is ignored with a warning.

    Parameters
    ----------
    commands : collection of tuple of str
        The words of every command that may have a table of options.

    Raises
    ------
    CycloptsError
        If a file cannot be read, is not TOML, or has a table that belongs to no command; it names the file.
    """
    try:
        os.lstat(_OURS)  # of the link, if it is one: only the folder matters here
    except PermissionError as error:
        text = f"no configuration is read: the working folder cannot be searched ({error.strerror})"
        warnings.warn(text, stacklevel=2)
        return []
    except OSError:
        pass
    tables = _read(_OURS, ("firefly",)), _read("pyproject.toml", ("tool", "firefly"))
    for table in filter(None, tables):
        _check_table(table.path, table.keys, _inner(table.content, table.keys), commands)
    return [table for table in tables if table is not None]


def _read(name: str, keys: Words) -> Table | None:
    """Return a file's table; None if there is none, or if a pyproject.toml of others cannot be read."""
    path, ours = _path(name), name == _OURS
    try:
        data = _bytes_of(name)
        if data is None:
            return None
        import tomllib

        ours |= b"firefly" in data
        content = tomllib.loads(data.decode())
    except (OSError, ValueError, RecursionError) as error:
        reason = error.strerror or error if isinstance(error, OSError) else f"it is not TOML: {error}"
        text = f"{path} cannot be read: {reason}"
        if ours:
            raise CycloptsError(text) from error
        warnings.warn(f"{text}; it is ignored", stacklevel=3)
        return None
    if name == _OURS and (others := sorted(set(content) - {keys[0]})):
        raise CycloptsError(f"{path}: {_NO_COMMAND.format(others[0])}")
    return None if _inner(content, keys) is None else Table(path, keys, content)


def as_sources(tables: Iterable[Table], allow_unknown: bool) -> list[Env | Dict]:
    """Return the environment and the tables as sources for cyclopts; earlier ones take precedence."""
    environment = Env if allow_unknown else _Environment
    return [
        environment("FIREFLY_", show=False),
        *(
            Dict(table.content, source=table.path, root_keys=table.keys, allow_unknown=allow_unknown)
            for table in tables
        ),
    ]


class _Environment(Env):
    """Environment variables as options; a warning names each that looks like an option and is none."""

    def __call__(self, app: App, commands: Words, arguments: ArgumentCollection) -> None:
        super().__call__(app, commands, arguments)
        if not commands:
            return
        prefix = "_".join(("FIREFLY", *commands, "")).upper()
        options = {name.lstrip("-") for argument in arguments for name in argument.names}
        known = [prefix + name.replace("-", "_").upper() for name in options]
        for variable in sorted(os.environ):
            if not variable.startswith(prefix) or variable in known:
                continue
            for new in RENAMED.get(variable.removeprefix(prefix).lower(), ()):
                if (renamed := prefix + new.upper()) in known:
                    raise CycloptsError(f"{variable} is now called {renamed}")
            close = did_you_mean(variable, known)
            text = f"{variable} names no option of firefly {' '.join(commands)} with this scene{close}"
            warnings.warn(text, stacklevel=2)


def error_text(error: CycloptsError, tables: Iterable[Table], words: Words) -> str:
    """Return the text of an error, in which a key of a file is called by its table and its file."""
    text, token = str(error), getattr(error, "token", None)
    if token is None:
        return text
    key = token.keyword or token.value
    place, dashes = key, ""
    for table in tables:
        if token.source == table.path and token.keyword:
            start = "".join(f"[{key}]" for key in table.keys)
            key = token.keyword.removeprefix(start)[1:-1].replace("][", ".")
            place = f"{key!r} in [{'.'.join((*table.keys, *words))}] of {table.path}"
            text, dashes = text.replace(token.keyword, place), "--"
    if isinstance(error, UnknownOptionError):
        names = (name for option in error.argument_collection for name in (*option.names, *option.negatives))
        known = [name.removeprefix(dashes) for name in names if name.startswith("--")]
        return f"Unknown option: {place}{did_you_mean(key.partition('=')[0], known)}"
    return text


def _bytes_of(name: str) -> bytes | None:
    """Return a file's bytes, None if it does not exist; never wait, for example for the writer of a pipe."""
    try:
        handle = os.open(name, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        if os.path.islink(name):
            raise OSError("it is a link to a file that does not exist") from None
        return None
    try:
        mode = os.fstat(handle).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISCHR(mode)):  # a character device is for example /dev/null
            raise OSError("it is not a file")
        data = b""
        while part := os.read(handle, _LARGEST):
            data += part
            if len(data) > _LARGEST:
                raise OSError(f"it has more than {_LARGEST} bytes")
        return data
    finally:
        os.close(handle)


def _inner(content: Any, keys: tuple[str, ...]) -> Any:
    """Return the value under `keys`, or None."""
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
    """Raise if `table` is no table, or has a key that leads to no command's table."""
    if not isinstance(table, dict):
        place = ".".join((*keys, *words))
        raise CycloptsError(f"{path}: {place} must be a table, [{place}], got {table!r}")
    if words in commands:
        return
    for key, value in table.items():
        inner = (*words, key)
        if not any(known[: len(inner)] == inner for known in commands):
            raise CycloptsError(f"{path}: {_NO_COMMAND.format('.'.join((*keys, *inner)))}")
        _check_table(path, keys, value, commands, inner)


def _path(name: str) -> str:
    try:
        return os.path.abspath(name)
    except OSError:  # the working folder is gone
        return name
