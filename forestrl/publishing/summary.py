"""The results in a few sentences: does it reproduce, what beats what, by how much."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from forestrl.publishing.comparisons import paired
from forestrl.publishing.reproduction import measured
from forestrl.publishing.results import Evaluation, Method, Results
from forestrl.publishing.statistics import Difference, Interval
from forestrl.publishing.tables import LABELS, ordered

_PRIVILEGED = "hindsight"


def summary(results: Results, policy: str) -> str:
    """Sums the results up for a reader in a hurry.

    Args:
        results: what was read.
        policy: name of the learned policy.

    Returns:
        a Markdown list, empty if the policy was not measured in the nominal forest.
    """
    methods = results.settings.get("nominal", {})
    if policy not in methods:
        return ""
    parts = (
        _reproduced(results, policy),
        _compared(methods, policy, ahead=True),
        _compared(methods, policy, ahead=False),
        _overtaken(methods, policy),
        _fastest(methods, policy),
    )
    return "".join(f"- {part}\n" for part in parts if part)


def _reproduced(results: Results, policy: str) -> str:
    """How many of the paper's statements hold, and which do not."""
    found = list(measured(results, policy))
    missed = [
        f"{claim.label} (paper {100 * claim.share:.0f} %)" for claim, _, reached in found if reached
    ]
    held = f"{len(found) - len(missed)} of the {len(found)} statements with a number hold"
    text = f"**Does it reproduce?** {held}."
    return text + (f" Not reached: {'; '.join(missed)}." if missed else "")


def _compared(methods: dict[str, Method], policy: str, *, ahead: bool) -> str:
    """The policies that it is ahead of at the end, or behind, with the paired difference."""
    ours, texts = methods[policy].first, []
    for name in ordered(methods.keys() - {policy, _PRIVILEGED}):
        difference = paired("coverage", ours, methods[name].first)
        if difference is not None and difference.sign == (1 if ahead else -1):
            texts.append(f"{LABELS.get(name, name)} ({_points(difference)})")
    words = "Ahead of" if ahead else "Behind"
    arenas = f"the same {ours.summary['arenas']} arenas"
    return (
        f"**{words}**, in coverage after {ours.steps} steps on {arenas}, in percentage points: "
        f"{_listed(texts)}."
        if texts
        else ""
    )


def _points(difference: Difference) -> str:
    mean, margin = difference.interval.mean, difference.interval.margin
    return f"{100 * mean:+.1f} ± {100 * margin:.1f}".replace("-", "−")


def _overtaken(methods: dict[str, Method], policy: str) -> str:
    """The policies that it is ahead of at first and behind at the end, and until when."""
    ours, texts = methods[policy].first, []
    for name in ordered(methods.keys() - {policy, _PRIVILEGED}):
        if (step := last_step_ahead(ours, methods[name].first)) is not None:
            texts.append(f"{LABELS.get(name, name)} (to step {step})")
    return f"**Ahead at first**, in mean coverage: {_listed(texts)}." if texts else ""


def last_step_ahead(ours: Evaluation, theirs: Evaluation) -> int | None:
    """Gives the last step at which our mean coverage is higher; None if never, or at the end."""
    steps, mine, other = np.intersect1d(
        ours.curve["step"], theirs.curve["step"], assume_unique=True, return_indices=True
    )
    (ahead,) = np.nonzero(ours.curve["mean"][mine] > theirs.curve["mean"][other])
    if len(ahead) == 0 or ahead[-1] == len(steps) - 1:
        return None
    return int(steps[ahead[-1]])


def _fastest(methods: dict[str, Method], policy: str) -> str:
    """How fast the fastest policy of which every run reaches 98 % is, and how fast ours."""
    found: dict[str, tuple[Interval, float]] = {}
    for name in methods.keys() - {_PRIVILEGED}:
        steps = methods[name].measure("steps_to_98")
        reached = methods[name].measure("reached_98")
        if steps is not None and reached is not None:
            found[name] = (steps, reached.mean)
    whole = [name for name, (_, share) in found.items() if share == 1 and name != policy]
    if not whole or policy not in found:
        return ""
    best = min(whole, key=lambda name: found[name][0].mean)
    fast, (slow, share) = found[best][0], found[policy]
    return (
        f"**Speed**: {LABELS.get(best, best)} reaches 98 % in every run, after "
        f"{fast.mean:.0f} ± {fast.margin:.0f} steps; {LABELS.get(policy, policy)} in "
        f"{100 * share:.0f} % of the runs, after {slow.mean:.0f} ± {slow.margin:.0f}."
    )


def _listed(texts: Iterable[str]) -> str:
    *first, last = texts
    return f"{', '.join(first)} and {last}" if first else last
