"""The paper's statements beside what was measured here."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

from forestrl import paper as P
from forestrl.publishing.results import Results
from forestrl.publishing.statistics import Interval
from forestrl.publishing.tables import LABELS, Column, forest, markdown, signed

Kind = Literal["≥", "≤", ""]
"""Whether more is better, less is, or neither."""


class Claim(NamedTuple):
    """A number of the paper, and where ours is found."""

    label: str
    setting: str
    policy: str
    measure: str
    share: float
    kind: Kind


def reproduction(results: Results, policy: str) -> str:
    """Sets the paper's statements beside ours; only those that were measured.

    Args:
        results: what was read.
        policy: name of the learned policy.

    Returns:
        a Markdown table, empty if nothing was measured.
    """
    rows = []
    for claim, value, unit, holds in findings(results, policy):
        paper = f"{claim.kind} {100 * claim.share:.0f}".strip()
        rows.append([claim.label, paper, Column("", claim.measure).cell(value), unit, holds])
    head = ["statement of the paper (%)", "paper", "here", "± over", "holds"]
    return markdown(head, rows) if rows else ""


class Finding(NamedTuple):
    """A statement of the paper, what was measured here and over what, and the verdict."""

    claim: Claim
    value: Interval
    unit: str
    verdict: str

    @property
    def holds(self) -> bool:
        """Whether the statement holds, be it within the interval."""
        return not self.verdict.startswith("no")


def findings(results: Results, policy: str) -> Iterable[Finding]:
    """Gives the statements that were measured."""
    for claim in _claims(policy):
        method = results.method(claim.setting, claim.policy)
        value = method.measure(claim.measure) if method else None
        if method and value:
            yield Finding(claim, value, method.unit, verdict(value, claim.share, claim.kind))


def _claims(policy: str) -> Iterable[Claim]:
    """All statements of Sec. III with a number."""
    learned, rate = LABELS.get(policy, f"`{policy}`"), "intervention_rate"
    for step, share in P.COVERAGE.items():
        label, measure = f"{learned}: coverage at {step} steps", f"coverage_{step}"
        yield Claim(label, "nominal", policy, measure, share, "≥")
    yield Claim("interventions, mean", "nominal", policy, rate, P.INTERVENTION_RATE, "≤")
    label, measure = "runs with under 15 % interventions", "share_under_15"
    yield Claim(label, "nominal", policy, measure, P.SHARE_UNDER_LIMIT, "≥")
    for setting, step in P.PASSED_AT.items():
        label, measure = f"{forest(setting)}: coverage at {step} steps", f"coverage_{step}"
        yield Claim(label, setting, policy, measure, P.MORE_THAN, "≥")
    label = "75 trunks: interventions, mean"
    yield Claim(label, "trees75", policy, rate, P.DENSE_INTERVENTION_RATE, "≤")
    for name, share in P.BENCHMARKS.items():
        planner = f"{name}_published"
        label, measure = f"{LABELS[planner]}: coverage at 2500 steps", "coverage_2500"
        yield Claim(label, "nominal", planner, measure, share, "")


def verdict(value: Interval, share: float, kind: Kind) -> str:
    """Tells whether a number of the paper holds here.

    Args:
        value: ours, with its interval.
        share: the paper's.
        kind: whether more is better, less is, or neither.

    Returns:
        yes, within the interval, or no with the difference in percentage points.
    """
    if (kind == "≥" and value.mean >= share) or (kind == "≤" and value.mean <= share):
        return "yes"
    if value.low <= share <= value.high or value.mean == share:
        return "within the interval"
    return f"no: {signed(100 * (value.mean - share))}"
