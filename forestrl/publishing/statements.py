"""The results in sentences: does it reproduce, what beats what, by how much."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from forestrl.evaluation.reading import Method, last_step_ahead, paired
from forestrl.publishing.catalogue import data, label, ordered, ranked
from forestrl.publishing.results import Results, Training
from forestrl.statistics import Interval
from forestrl.tables import Column, markdown, signed


class Finding(NamedTuple):
    """A statement of the paper, what was measured here and over what, and the verdict."""

    label: str
    policy: str
    measure: str
    share: float
    kind: str
    value: Interval
    unit: str

    @property
    def verdict(self) -> str:
        """Yes, within the interval, or no with the difference in percentage points."""
        return verdict(self.value, self.share, self.kind)

    @property
    def holds(self) -> bool:
        """Whether the statement holds, be it within the interval."""
        return not self.verdict.startswith("no")

    @property
    def here(self) -> str:
        """Our number, in per cent."""
        return Column("", self.measure).cell(self.value)


def verdict(value: Interval, share: float, kind: str) -> str:
    """Tells whether a number of the paper holds here.

    Args:
        value: ours, with its interval.
        share: the paper's.
        kind: ``≥`` or ``≤`` where more or less is better, ``=`` for neither.

    Returns:
        yes, within the interval, or no with the difference in percentage points.
    """
    if (kind == "≥" and value.mean >= share) or (kind == "≤" and value.mean <= share):
        return "yes"
    if value.low <= share <= value.high or value.mean == share:
        return "within the interval"
    return f"no: {signed(100 * (value.mean - share))}"


def findings(results: Results, method: str) -> list[Finding]:
    """Gives the paper's statements that were measured.

    Args:
        results: what was read.
        method: name of the paper's policy in the results.
    """
    found = []
    for claim in data("claims"):
        policy = method if claim["policy"] == "METHOD" else claim["policy"]
        ours = results.method(claim["setting"], policy)
        value = ours.measure(claim["measure"]) if ours else None
        if ours and value:
            text = claim["label"].format(method=label(method))
            parts = (claim["measure"], claim["share"], claim["kind"])
            found.append(Finding(text, policy, *parts, value, ours.unit))
    return found


def reproduction(results: Results, method: str) -> str:
    """Sets the paper's statements beside ours as a Markdown table; empty if none was measured."""
    rows = [
        [f.label, f"{f.kind.strip('=')} {100 * f.share:.0f}".strip(), f.here, f.unit, f.verdict]
        for f in findings(results, method)
    ]
    head = ["statement of the paper (%)", "paper", "here", "± over", "holds"]
    return markdown(head, rows) if rows else ""


def summary(results: Results, method: str) -> str:
    """Sums the results up for a reader in a hurry.

    Args:
        results: what was read.
        method: name of the paper's policy in the results.

    Returns:
        a Markdown list, empty if the policy was not measured in the nominal forest.
    """
    methods = results.settings.get("nominal", {})
    if method not in methods:
        return ""
    parts = (
        _reproduced(findings(results, method), method),
        _last_checkpoints(list(results.training.values())),
        _compared(methods, method, sign=1),
        _compared(methods, method, sign=-1),
        _fastest(methods, method),
        _overtaken(methods, method),
    )
    return "".join(f"- {part}\n" for part in parts if part)


def _reproduced(found: list[Finding], method: str) -> str:
    """How many of the paper's statements hold, those of its policy and those of its benchmarks."""
    ours = [each for each in found if each.policy == method]
    others = [each for each in found if each.policy != method]
    held = sum(each.holds for each in ours)
    text = (
        f"**Does it reproduce?** Of the paper's {len(ours)} numbers about its policy, {held} are "
        f"reached or passed: {'; '.join(_beside(each, method) for each in ours[:4])}."
    )
    if others:
        text += f" Its benchmarks: {'; '.join(_beside(each, method) for each in others)}."
    return text


def _beside(finding: Finding, method: str) -> str:
    """A number of ours with the paper's."""
    name = finding.label.removeprefix(f"{label(method)}: ")
    return f"{name} {finding.here} % (paper {100 * finding.share:.0f})"


def _last_checkpoints(trainings: list[Training]) -> str:
    """What the policies were at the end of their trainings."""
    curves = [
        training.metrics["eval/coverage"].dropna()
        for training in trainings
        if "eval/coverage" in training.metrics
    ]
    if not curves or len(curves) < len(trainings) or any(curve.empty for curve in curves):
        return ""
    *first, last = (f"{100 * curve.iloc[-1]:.1f}" for curve in curves)
    ends = f"{', '.join(first)} and {last}" if first else last
    return (
        "**Under which conditions?** Trained with an entropy bonus, of which the paper says "
        f"nothing; each seed's policy is the best of {min(map(len, curves))} checkpoints, by the "
        f"coverage curve in other arenas. The last checkpoints cover {ends} % there."
    )


def _compared(methods: dict[str, Method], method: str, *, sign: int) -> str:
    """The other methods that it is ahead of at the end, or behind, with the paired difference."""
    ours, texts, arenas = methods[method].first, [], set()
    for name in _others(methods, method):
        found = paired("coverage", ours, methods[name].first)
        if found is not None and found.sign == sign:
            mean, margin = found.interval.mean, found.interval.margin
            texts.append(f"{label(name)} {signed(100 * mean)} ± {100 * margin:.1f}")
            arenas.add(found.arenas)
    if not texts:
        return ""
    words = "What it beats" if sign > 0 else "What beats it"
    same = " to ".join(map(str, sorted({min(arenas), max(arenas)})))
    return (
        f"**{words}**, one checkpoint on the same {same} arenas, coverage after {ours.steps} steps "
        f"in percentage points: {'; '.join(texts)}."
    )


def _fastest(methods: dict[str, Method], method: str) -> str:
    """In how many steps the others of which every run reaches 98 % do so, and ours."""
    found = {}
    for name in (method, *_others(methods, method)):
        steps, reached = (methods[name].measure(one) for one in ("steps_to_98", "reached_98"))
        if steps is not None and reached is not None and (name == method or reached.mean == 1):
            text = f"{steps.mean:.0f} ± {steps.margin:.0f}"
            found[name] = f"{text} in {100 * reached.mean:.0f} % of the runs"
    ours = found.pop(method, "")
    if not ours or not found:
        return ""
    texts = [f"{label(name)} {text}" for name, text in found.items()]
    return f"**Steps to 98 %**: {label(method)} {ours}; {'; '.join(texts)}."


def _overtaken(methods: dict[str, Method], method: str) -> str:
    """The methods that it is ahead of at first and behind at the end, and until when."""
    ours, texts = methods[method].first, []
    for name in _others(methods, method):
        if (step := last_step_ahead(ours, methods[name].first)) is not None:
            texts.append(f"{label(name)} to step {step}")
    return f"**Ahead at first**, in mean coverage: of {'; '.join(texts)}." if texts else ""


def _others(methods: Iterable[str], method: str) -> list[str]:
    """The other methods that compete."""
    return [name for name in ordered(methods) if name != method and ranked(name)]
