"""Damage for model files: values of JSON that are of other types or lie, and bytes that are wrong or gone."""

from __future__ import annotations

import copy
import random
from typing import Any

VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 3, 255, 65536, 2**31, 2**32, 2**63, 10**40, 0.5, -0.5, 1e30, 1e300, -1e300,
    "", "a", "\ud800", "../a", "data:,abc", "data:;base64,AAAA", "VEC2", "VEC3", "VEC4", "MAT4", "SCALAR",
    5120, 5121, 5122, 5123, 5125, 5126, [], {}, [0], [None], [[]], [1e30, 0, 0], {"a": 1}, [{}], [0] * 20,
)  # fmt: skip


def places(found: Any) -> list[tuple[Any, Any]]:
    """(container, key or index) of every value in JSON."""
    inner: list[tuple[Any, Any]] = []
    waiting = [found]
    while waiting:
        container = waiting.pop()
        keys = container if isinstance(container, dict) else range(len(container))
        for key in keys:
            inner.append((container, key))
            if isinstance(container[key], dict | list):
                waiting.append(container[key])
    return inner


def mutated_json(found: Any, chance: random.Random) -> Any:
    """A copy in which one to three values are others, are gone, are there twice, or have changed places."""
    found = copy.deepcopy(found)
    for _ in range(chance.randint(1, 3)):
        inner = places(found)
        if not inner:
            break
        container, key = chance.choice(inner)
        act = chance.random()
        if act < 0.6:
            container[key] = copy.deepcopy(chance.choice(VALUES))
        elif act < 0.8:
            del container[key]
        elif act < 0.9:
            other, place = chance.choice(inner)
            container[key] = copy.deepcopy(other[place])
        elif isinstance(container, list):
            container.append(copy.deepcopy(container[key]))
        else:
            container[f"{key}_"] = container.pop(key)
    return found


def mutated_bytes(data: bytes, chance: random.Random) -> bytes:
    """Bytes with some bits flipped, or some bytes replaced, left out, repeated or cut off."""
    found = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        if not found:
            break
        place = chance.randrange(len(found))
        act = chance.randrange(5)
        if act == 0:
            found[place] ^= 1 << chance.randrange(8)
        elif act == 1:
            found[place] = chance.choice((0, 255, chance.randrange(256)))
        elif act == 2:
            del found[place : place + chance.randint(1, 8)]
        elif act == 3:
            found[place:place] = found[place : place + chance.randint(1, 8)]
        else:
            found[place : place + 4] = b"\xff\xff\xff\x7f"
    if chance.random() < 0.2:
        del found[chance.randrange(len(found) + 1) :]
    return bytes(found)
