"""Path patterns, the small language in which Panda3D searches for nodes.

A pattern is a row of elements joined by ``/``; each matches one node on the path down:

=============  =========================================================================
``name``       a node of this name; ``*``, ``?``, ``[abc]`` and ``[!abc]`` work as in a shell
``*``          any one node
``**``         any number of nodes, including none
``+Type``      a node of this class or one derived from it, for example ``+GeomNode``
``-Type``      a node of exactly this class
``=tag``       a node that has the tag
``=tag=text``  a node whose tag has this value; shell characters work as in a name
=============  =========================================================================

After the last element ``;`` and flags: ``+i`` ignores upper and lower case in names; ``-h`` skips
hidden nodes and all below them (``+h``, the default, does not). ``+s`` and ``-s`` are read and change
nothing, because nodes are never stashed here.
"""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Callable, Iterator

from firefly_sample.errors import NodeError
from firefly_sample.scene.node import OVERALL_BIT, PandaNode
from firefly_sample.scene.path_step import PathStep

_Test = Callable[[PandaNode], bool]


def find_paths(start: PathStep, pattern: str) -> Iterator[PathStep]:
    """Yield every path that begins at `start` and matches the pattern, each once.

    The shortest paths come first, and among equally long ones those of earlier children (Panda3D defines no
    order). Raise NodeError for an element or a flag that is not in the language; the message names it.
    """
    tests, skips_hidden = _parse(pattern)
    level = {start: _with_skipped({0}, tests)}
    while level:
        below: dict[PathStep, set[int]] = {}
        for step, reached in level.items():
            if len(tests) in reached:
                yield step
            if reached == {len(tests)}:
                continue
            for child in step.node.children:
                if skips_hidden and not child.draw_show & OVERALL_BIT:
                    continue
                after = _after(child, reached, tests)
                if after:
                    below[step.child(child)] = after
        level = below


def _after(node: PandaNode, reached: set[int], tests: list[_Test | None]) -> set[int]:
    """Return how many elements may be matched after one more node; `reached` is how many before it."""
    used = set()
    for index in reached - {len(tests)}:
        test = tests[index]
        if test is None or test(node):
            used.add(index if test is None else index + 1)
    return _with_skipped(used, tests)


def _with_skipped(reached: set[int], tests: list[_Test | None]) -> set[int]:
    """Also count a ``**`` that comes next as matched, because it may match no node."""
    for index in sorted(reached):
        while index < len(tests) and tests[index] is None:
            index += 1
            reached.add(index)
    return reached


def _parse(pattern: str) -> tuple[list[_Test | None], bool]:
    """Return one test for each element, None for ``**``; and whether hidden nodes are skipped."""
    if not isinstance(pattern, str):
        raise NodeError(f"a path pattern must be text, got {pattern!r}")
    elements, _, flags = pattern.partition(";")
    given = re.findall(r"[+-][his]", flags)
    if "".join(given) != flags:
        raise NodeError(f"path pattern {pattern!r}: flags {flags!r} must be made of +i -i +h -h +s -s")
    signs = {flag: sign for sign, flag in given}  # the last of equal flags counts
    tests = [_test(element, signs.get("i") == "+", pattern) for element in elements.split("/")]
    return tests, signs.get("h") == "-"


def _test(element: str, ignores_case: bool, pattern: str) -> _Test | None:
    if element == "**":
        return None
    if element in ("", ".", "..") or element.startswith("@@"):
        ways_out = {
            "": "write one slash between names, none at the ends",
            ".": "leave it out",
            "..": "start from get_parent()",
        }
        way_out = ways_out.get(element, "nodes are never stashed here")
        raise NodeError(f"path pattern {pattern!r}: element {element!r} is not supported; {way_out}")
    if element[0] in "+-":
        kind, exact = _node_class(element, pattern), element[0] == "-"
        return (lambda node: type(node) is kind) if exact else (lambda node: isinstance(node, kind))
    if element[0] == "=":
        tag, has_value, value = element[1:].partition("=")
        if not has_value:
            return lambda node: tag in node.tags
        matches_value = _glob(value, ignores_case=False)
        return lambda node: tag in node.tags and matches_value(node.tags[tag])
    matches = _glob(element, ignores_case)
    return lambda node: matches(node.name)


def _node_class(element: str, pattern: str) -> type[PandaNode]:
    kinds = [PandaNode]
    for kind in kinds:  # the list grows meanwhile
        kinds.extend(kind.__subclasses__())
    classes = {kind.__name__: kind for kind in kinds if not kind.__name__.startswith("_")}
    found = classes.get(element[1:])
    if found is None:
        raise NodeError(
            f"path pattern {pattern!r}: element {element!r} names no class of nodes; there are "
            f"{', '.join(sorted(classes))} (a name that begins with + or - is written [+] or [-])"
        )
    return found


def _glob(text: str, ignores_case: bool) -> Callable[[str], bool]:
    expression = re.compile(fnmatch.translate(text), re.IGNORECASE if ignores_case else 0)
    return lambda name: expression.match(name) is not None
