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
    """A file's table of options: the file's path, the keys that lead to the table, and the whole file."""

    path: str
    keys: Words
    content: dict[str, Any]


def read_configuration(commands: Collection[Words]) -> list[Table]:
    """Read both files, if they exist; `commands` are the words of all that may have a table of options.

    A CycloptsError names a file that cannot be read, is not TOML, or has a table that belongs to no command.
    But a pyproject.toml may belong to any project: if it cannot be read and does not contain the word
    firefly, it is ignored with a warning.
    """
    try:
        os.lstat(_OURS)  # of the link, if it is one: only the folder matters here
    except PermissionError as error:
        text = f"no configuration is read: the working folder cannot be searched ({error.strerror})"
        warnings.warn(text, stacklevel=2)
        return []
    except OSError:
        pass
    read = _read(_OURS, ("firefly",)), _read("pyproject.toml", ("tool", "firefly"))
    tables = [table for table in read if table is not None]
    for table in tables:
        _check_table(table, _inner(table.content, table.keys), commands)
    return tables


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
    key = label = token.keyword or token.value
    dashes = ""
    for table in tables:
        if token.source == table.path and token.keyword:
            start = "".join(f"[{key}]" for key in table.keys)
            key = token.keyword.removeprefix(start)[1:-1].replace("][", ".")
            label = f"{key!r} in [{'.'.join((*table.keys, *words))}] of {table.path}"
            text, dashes = text.replace(token.keyword, label), "--"
    if isinstance(error, UnknownOptionError):
        names = (name for option in error.argument_collection for name in (*option.names, *option.negatives))
        known = [name.removeprefix(dashes) for name in names if name.startswith("--")]
        return f"Unknown option: {label}{did_you_mean(key.partition('=')[0], known)}"
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


def _inner(content: Any, keys: Words) -> Any:
    """Return the value under `keys`, or None."""
    for key in keys:
        content = content.get(key) if isinstance(content, dict) else None
    return content


def _check_table(table: Table, value: object, commands: Collection[Words], words: Words = ()) -> None:
    """Raise if `value`, at `words` in a table, is no table, or has a key that leads to no command's table."""
    name = ".".join((*table.keys, *words))
    if not isinstance(value, dict):
        raise CycloptsError(f"{table.path}: {name} must be a table, [{name}], got {value!r}")
    if words in commands:
        return
    for key, inner in value.items():
        longer = (*words, key)
        if not any(known[: len(longer)] == longer for known in commands):
            raise CycloptsError(f"{table.path}: {_NO_COMMAND.format(f'{name}.{key}')}")
        _check_table(table, inner, commands, longer)


def _path(name: str) -> str:
    try:
        return os.path.abspath(name)
    except OSError:  # the working folder is gone
        return name
