"""Choose a frame's passes and targets: a target exists because an output or a pass that is there reads it.

Passes declare what they would do (`Declaration`), in drawing order. Going back from the outputs, a pass is
there if somebody reads what it makes, and what it reads is wanted from the passes before it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from firefly_sample.errors import PlanError
from firefly_sample.plan.frame_plan import PassPlan
from firefly_sample.plan.frame_targets import TARGETS, Shape, make_target, output_reads, output_sources
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import Variant

Reasons = Mapping[str, Sequence[str]]


@dataclass(frozen=True)
class Declaration:
    """What a pass does in a frame if somebody reads what it makes.

    Attributes
    ----------
    because : str
        What in the scene asks for it.
    reads : mapping of str to sequence of str
        Targets that it samples, and why.
    writes : sequence of str
        Targets that it clears and fills, as far as somebody reads them.
    fills : sequence of str
        Targets that several passes add to, likewise; the first one clears them.
    updates : sequence of str
        Targets of passes before it that it draws over, likewise.
    tests : sequence of str
        Depth buffers that it tests against, as far as the frame has them.
    keeps : mapping of str to sequence of str
        Targets that it writes because it needs them itself, and why.
    targets : mapping of str to callable
        Targets that are not in `firefly_sample.plan.frame_targets.TARGETS`: a function of the `Needs` that
        returns the arguments of `Target`, for example ``{"format": "rgba8"}``.
    """

    because: str
    reads: Reasons = field(default_factory=dict)
    writes: Sequence[str] = ()
    fills: Sequence[str] = ()
    updates: Sequence[str] = ()
    tests: Sequence[str] = ()
    keeps: Reasons = field(default_factory=dict)
    targets: Mapping[str, Callable[[Needs], Shape]] = field(default_factory=dict)


class Declares(Protocol):
    """What planning knows of a pass."""

    name: str

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what the pass would do, None if the scene has nothing for it."""

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the variant of its shader in a frame with some targets, by name."""


class FrameGraph(NamedTuple):
    """What a frame draws, and into what.

    Attributes
    ----------
    targets : tuple of Target
    passes : tuple of PassPlan
        In drawing order.
    sources : dict of str to tuple of str
        The targets that each output is decoded from.
    """

    targets: tuple[Target, ...]
    passes: tuple[PassPlan, ...]
    sources: dict[str, tuple[str, ...]]


def choose_passes(passes: Iterable[Declares], needs: Needs) -> FrameGraph:
    """Return the targets and the passes of a frame, each with its reason.

    Raises
    ------
    PlanError
        As `check_passes`.
    """
    outputs: dict[str, dict[str, None]] = {}
    for output in needs.outputs:
        for name, reason in output_reads(needs, output).items():
            outputs.setdefault(name, {})[reason] = None
    chosen = _wanted_passes(passes, needs, set(outputs))

    made: dict[str, dict[str, None]] = {}
    own: dict[str, Callable[[Needs], Shape]] = {}
    for _, plan in chosen:
        own.update(plan.targets)
        for name in (*plan.writes, *plan.fills, *plan.keeps):
            made.setdefault(name, {})
    readers = [*(reads for _, plan in chosen for reads in (plan.keeps, plan.reads)), outputs]
    for reads in readers:
        for name, reasons in reads.items():
            if name in made:
                made[name] |= dict.fromkeys(reasons)
    order = [*TARGETS, *own]
    targets = {
        name: make_target(name, needs, "; ".join(reasons), own)
        for name, reasons in sorted(made.items(), key=lambda entry: order.index(entry[0]))
        if reasons
    }
    steps = _steps(chosen, needs, targets)
    check_passes(steps, targets.values())
    sources = {output: output_sources(needs, output, targets) for output in needs.outputs}
    return FrameGraph(tuple(targets.values()), steps, sources)


def _wanted_passes(
    passes: Iterable[Declares], needs: Needs, wanted: set[str]
) -> list[tuple[Declares, Declaration]]:
    """Return the passes that make what outputs, or passes after them, want, in drawing order."""
    declared = [(step, plan) for step in passes if (plan := step.declare(needs)) is not None]
    chosen = []
    for step, plan in reversed(declared):
        if wanted.intersection((*plan.writes, *plan.fills, *plan.updates)):
            chosen.append((step, plan))
            wanted.update(plan.reads, plan.tests, plan.keeps)
    return chosen[::-1]


def _steps(
    chosen: Iterable[tuple[Declares, Declaration]], needs: Needs, targets: Mapping[str, Target]
) -> tuple[PassPlan, ...]:
    filled: set[str] = set()
    steps = []
    for step, plan in chosen:
        writes = [name for name in (*plan.writes, *plan.fills) if name in targets and name not in filled]
        updates = [name for name in (*plan.fills, *plan.updates, *plan.tests) if name in targets]
        updates = [name for name in updates if name not in writes]
        filled.update(name for name in plan.fills if name in targets)
        variant = step.variant(needs, targets)
        steps.append(
            PassPlan(step.name, tuple(plan.reads), tuple(writes), tuple(updates), plan.because, variant)
        )
    return tuple(steps)


def check_passes(passes: Iterable[PassPlan], targets: Iterable[Target]) -> None:
    """Hold the passes against each other.

    Raises
    ------
    PlanError
        If a pass touches a target that does not exist, reads or updates what no pass wrote before it, or
        samples what it also draws into, or if a target is never written.
    """
    names = {target.name for target in targets}
    written: set[str] = set()
    for step in passes:
        for name in (*step.reads, *step.writes, *step.updates):
            if name not in names:
                raise PlanError(f"pass {step.name!r} uses target {name!r}, which this frame does not have")
        for name in (*step.reads, *step.updates):
            if name not in written:
                raise PlanError(f"pass {step.name!r} reads target {name!r}, which no pass wrote before it")
        for name in step.reads:
            if name in step.writes or name in step.updates:
                raise PlanError(f"pass {step.name!r} samples target {name!r} while it draws into it")
        written.update(step.writes)
    for name in sorted(names - written):
        raise PlanError(f"target {name!r} is never written by any pass")
