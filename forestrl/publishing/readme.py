"""The text of the results: tables and figures with the commands behind them, put into a README."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from pathlib import Path

from forestrl.publishing.comparisons import differences, forests
from forestrl.publishing.endings import endings
from forestrl.publishing.files import ResultError
from forestrl.publishing.learning import learning
from forestrl.publishing.panel import Panel
from forestrl.publishing.reproduction import reproduction
from forestrl.publishing.results import FIGURES, Evaluation, Results, Training
from forestrl.publishing.summary import summary
from forestrl.publishing.tables import headline

_START, _END = "<!-- results -->", "<!-- /results -->"
_WORDS = {
    "summary": """### In a minute

± is the larger side of the 95 % bootstrap interval of a mean. Over training seeds for the method:
with three of them that is about their range. Over arenas for one checkpoint or planner.
""",
    "reproduction": "### Does it reproduce?\n",
    "headline": """### What beats what

Nominal forest (h = 50, 45 trunks). Coverage, area under the coverage curve and interventions in
per cent. Steps to 98 %: mean of the runs that got there, whose share stands beside. ± as above,
over what its column says. **Bold**: best of a column; for steps only where 95 % of the runs got
there. Planners that never need an intervention do not count in those columns; hindsight and the
most probable action count in none. *Italics*: numbers from elsewhere. The paper's are its text's.
Explore-Bench's grid simulator (commit ce3b98a, its planning as it is) was run in 40 forests of this
size with a wall around; its LiDAR sees a square, its trunks have integer centres and radii, and it
counts all free cells. The plain program was written without this code and run in 300 other forests;
its rule for ties is its own.
""",
    "endings": """### How the runs end

Share of the runs in the nominal forest, in per cent: 98 % of the cells reached, or why not. The
planners as published keep the faults of Explore-Bench's planning, though not of its LiDAR, and go
round in cycles or aim at trunks; corrected, with path lengths over diagonal moves too and frontiers
out of reach left aside, none does. Cycles are detected for planners only: the most probable action
ends in them too. The last column is the mean coverage at the end of the runs that did not reach
98 %.
""",
    "differences": """### By how much

Paired differences on the same arenas of the nominal forest, for one checkpoint: ± is the larger
side of the 95 % bootstrap interval over arenas. Coverage, area and interventions in percentage
points; steps over the arenas where both got to 98 %, whose number stands beside. **Bold**: the
interval excludes 0 in favour of the first; *italics*: in favour of the other.
""",
    "forests": """### Denser and larger forests, and longer episodes

In per cent; ± as above, but for coverage at 5000 steps: 1.96 standard errors of the mean. "Stuck":
planners that can no longer move on; it is not detected for other policies.
""",
    "ablations": """### What each part is good for

Short trainings with a part left out or another β, each measured at its end on 100 arenas, made by
`forestrl train experiment=ablations hydra.sweep.dir=multirun/results/ablations`.
""",
}
"""What stands above each table, in the order of the README."""
_APART = "differences"
"""Has a file of its own."""
_LONG = {"differences", "forests"}
"""Are folded in the README."""


def tables(results: Results, policy: str, ablations: str) -> dict[str, str]:
    """Writes ``table.md``, ``differences.md`` and ``learning.md``; what has no data is empty.

    Args:
        results: what was read.
        policy: name of the learned policy.
        ablations: the table of the ablations.
    """
    found = _tables(results, policy, ablations)
    pairs = found.pop(_APART, "")
    main = "\n".join(found.values())
    return {"table.md": main, "differences.md": pairs, "learning.md": learning(results)}


def _tables(results: Results, policy: str, ablations: str) -> dict[str, str]:
    """Every table that there is data for, under its heading."""
    made = {
        "summary": summary(results, policy),
        "reproduction": reproduction(results, policy),
        "headline": headline(results),
        "endings": endings(results),
        "differences": differences(results, policy),
        "forests": forests(results),
        "ablations": ablations,
    }
    return {name: f"{_WORDS[name]}\n{table}" for name, table in made.items() if table}


def text(
    results: Results,
    policy: str,
    ablations: str,
    panels: Mapping[str, Panel | str],
    *,
    readme: Path,
    training: Mapping[Path, str],
) -> str:
    """Writes what stands between the marks of the README.

    Args:
        results: what was read.
        policy: name of the learned policy.
        ablations: the table of the ablations.
        panels: every figure.
        readme: the file, to which the links are relative.
        training: commands of the trainings, by the file of their metrics.
    """
    found = _tables(results, policy, ablations)
    parts = [_folded(table) if name in _LONG else table for name, table in found.items()]
    drawn = {name: panel for name, panel in panels.items() if isinstance(panel, Panel)}
    if drawn:
        parts.append("### Figures\n")
    for name, panel in drawn.items():
        path = os.path.relpath(results.folder / FIGURES / f"{name}.png", readme.parent or ".")
        link, title = Path(path).as_posix(), f"Fig. {name.removeprefix('fig')}"
        lines = [f"# {link}", _draw_command(results, policy)]
        lines += ["# its data", *(_data_command(each, training) for each in panel.sources)]
        commands = "\n".join(dict.fromkeys(lines))
        parts.append(
            f'<img src="{link}" width="440" alt="{title}">\n\n**{title}.** {panel.caption}\n\n'
            f"<details><summary>commands</summary>\n\n```bash\n{commands}\n```\n\n</details>\n"
        )
    return "\n".join(parts)


def _folded(part: str) -> str:
    """Folds what stands under a heading."""
    heading, _, rest = part.partition("\n")
    return f"{heading}\n\n<details><summary>table</summary>\n{rest}\n</details>\n"


def _draw_command(results: Results, policy: str) -> str:
    asked = [] if policy == "learned" else [f"policy={policy}"]
    if (folder := results.folder.as_posix()) != "multirun/results":
        asked.append(f"results={folder}")
    return shlex.join(["forestrl", "figures", *asked])


def _data_command(source: Evaluation | Training, training: Mapping[Path, str]) -> str:
    """The command that made the data; an evaluation writes them where they are."""
    if isinstance(source, Training):
        return training.get(source.path, f"# {source.path.as_posix()}: command not recorded")
    folder = source.folder.as_posix()
    if (command := source.summary["meta"].get("command")) is None:
        return f"# {folder}: command not recorded"
    return f"{command} {shlex.quote(f'hydra.run.dir={folder}')}"


def replace_between_marks(old: str, new: str) -> str:
    """Puts a text between the marks; everything else stays.

    Args:
        old: the whole file.
        new: what belongs between the marks.

    Raises:
        ResultError: if the marks are not there once each, in order.
    """
    if old.count(_START) != 1 or old.count(_END) != 1 or old.index(_START) > old.index(_END):
        raise ResultError(f"the README wants {_START} and, after it, {_END}, once each")
    before, _, rest = old.partition(_START)
    return f"{before}{_START}\n\n{new.strip()}\n\n{_END}{rest.partition(_END)[2]}"
