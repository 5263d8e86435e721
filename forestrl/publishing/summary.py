"""The results in a few sentences: does it reproduce, what beats what, by how much."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from forestrl.publishing.comparisons import paired
from forestrl.publishing.reproduction import Finding, findings
from forestrl.publishing.results import Evaluation, Method, Results, Training
from forestrl.publishing.tables import LABELS, PRIVILEGED, Column, ordered, signed


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
        _reproduced(list(findings(results, policy)), policy),
        _last_checkpoints(list(results.training.values())),
        _compared(methods, policy, sign=1),
        _compared(methods, policy, sign=-1),
        _fastest(methods, policy),
        _overtaken(methods, policy),
    )
    return "".join(f"- {part}\n" for part in parts if part)


def _reproduced(found: list[Finding], policy: str) -> str:
    """How many of the paper's statements hold, those of its policy and those of its benchmarks."""
    ours = [each for each in found if each.claim.policy == policy]
    others = [each for each in found if each.claim.policy != policy]
    held = sum(each.holds for each in ours)
    text = (
        f"**Does it reproduce?** Of the paper's {len(ours)} numbers about its policy, {held} are "
        f"reached or passed: {'; '.join(map(_beside, ours[:4]))}."
    )
    if others:
        text += f" Its benchmarks: {'; '.join(map(_beside, others))}."
    return text


def _beside(finding: Finding) -> str:
    """A number of ours with the paper's."""
    label = finding.claim.label.removeprefix(f"{LABELS['learned']}: ")
    ours = Column("", finding.claim.measure).cell(finding.value)
    return f"{label} {ours} % (paper {100 * finding.claim.share:.0f})"


def _last_checkpoints(trainings: list[Training]) -> str:
    """What the policies were at the end of their trainings."""
    each = [training.metrics.get("eval/coverage", np.array([])) for training in trainings]
    curves = [values[~np.isnan(values)] for values in each]
    if not curves or any(len(values) == 0 for values in curves):
        return ""
    ends = _listed(f"{100 * float(values[-1]):.1f}" for values in curves)
    count = min(len(values) for values in curves)
    return (
        "**Under which conditions?** Trained with an entropy bonus, of which the paper says "
        f"nothing; each seed's policy is the best of {count} checkpoints, by the coverage curve in "
        f"other arenas. The last checkpoints cover {ends} % there."
    )


def _compared(methods: dict[str, Method], policy: str, *, sign: int) -> str:
    """The other methods that it is ahead of at the end, or behind, with the paired difference."""
    ours, texts, arenas = methods[policy].first, [], set()
    for name in _others(methods, policy):
        difference = paired("coverage", ours, methods[name].first)
        if difference is not None and difference.sign == sign:
            mean, margin = difference.interval.mean, difference.interval.margin
            texts.append(f"{LABELS.get(name, name)} {signed(100 * mean)} ± {100 * margin:.1f}")
            arenas.add(difference.arenas)
    if not texts:
        return ""
    words = "What it beats" if sign > 0 else "What beats it"
    same = " to ".join(map(str, sorted({min(arenas), max(arenas)})))
    return (
        f"**{words}**, one checkpoint on the same {same} arenas, coverage after {ours.steps} steps "
        f"in percentage points: {'; '.join(texts)}."
    )


def _fastest(methods: dict[str, Method], policy: str) -> str:
    """In how many steps the others of which every run reaches 98 % do so, and ours."""
    found = {}
    for name in (policy, *_others(methods, policy)):
        steps = methods[name].measure("steps_to_98")
        reached = methods[name].measure("reached_98")
        if steps is not None and reached is not None and (name == policy or reached.mean == 1):
            text = f"{steps.mean:.0f} ± {steps.margin:.0f}"
            found[name] = f"{text} in {100 * reached.mean:.0f} % of the runs"
    ours = found.pop(policy, "")
    if not ours or not found:
        return ""
    texts = [f"{LABELS.get(name, name)} {text}" for name, text in found.items()]
    return f"**Steps to 98 %**: {LABELS.get(policy, policy)} {ours}; {'; '.join(texts)}."


def _overtaken(methods: dict[str, Method], policy: str) -> str:
    """The methods that it is ahead of at first and behind at the end, and until when."""
    ours, texts = methods[policy].first, []
    for name in _others(methods, policy):
        if (step := last_step_ahead(ours, methods[name].first)) is not None:
            texts.append(f"{LABELS.get(name, name)} to step {step}")
    return f"**Ahead at first**, in mean coverage: of {'; '.join(texts)}." if texts else ""


def last_step_ahead(ours: Evaluation, theirs: Evaluation) -> int | None:
    """Gives the last step at which our mean coverage is higher; None if never, or at the end."""
    steps, mine, other = np.intersect1d(
        ours.curve["step"], theirs.curve["step"], assume_unique=True, return_indices=True
    )
    (ahead,) = np.nonzero(ours.curve["mean"][mine] > theirs.curve["mean"][other])
    if len(ahead) == 0 or ahead[-1] == len(steps) - 1:
        return None
    return int(steps[ahead[-1]])


def _others(methods: dict[str, Method], policy: str) -> list[str]:
    """The other methods, but for the privileged one and the policy's own most probable actions."""
    return ordered(methods.keys() - {policy, f"{policy}_mode", PRIVILEGED})


def _listed(texts: Iterable[str]) -> str:
    *first, last = texts
    return f"{', '.join(first)} and {last}" if first else last
