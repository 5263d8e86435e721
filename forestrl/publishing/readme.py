"""The text of the results: tables and figures with the commands behind them, put into a README."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from pathlib import Path

from forestrl.publishing.comparisons import differences, forests
from forestrl.publishing.files import ResultError
from forestrl.publishing.panel import Panel
from forestrl.publishing.reproduction import reproduction
from forestrl.publishing.results import FIGURES, Evaluation, Results, Training
from forestrl.publishing.tables import headline

_START, _END = "<!-- results -->", "<!-- /results -->"
_REPRODUCTION = """### Does it reproduce?

"""
_HEADLINE = """### What beats what

Nominal forest (h = 50, 45 trunks). Coverage, area under the coverage curve and interventions in
per cent. Steps to 98 %: mean of the runs that got there, whose share stands beside. ± is the larger
side of the 95 % bootstrap interval of the mean, over what its column says: arenas are resampled for
one checkpoint or planner, training seeds for the method. **Bold**: best of a column; for steps only
where 95 % of the runs got there. Planners that never need an intervention do not count in those
columns, nor does hindsight in any.

"""
_DIFFERENCES = """### By how much

Paired differences on the same arenas of the nominal forest, for one checkpoint: ± is the larger
side of the 95 % bootstrap interval over arenas. Coverage, area and interventions in percentage
points; steps over the arenas where both got to 98 %, whose number stands beside. **Bold**: the
interval excludes 0 in favour of the first; *italics*: in favour of the other.

"""
_FORESTS = """### Denser and larger forests

Coverage and interventions in per cent; ± as above.

"""


def tables(results: Results, policy: str) -> dict[str, str]:
    """Writes ``table.md`` and ``differences.md``; a part without any data is left out.

    Args:
        results: what was read.
        policy: name of the learned policy.
    """
    *others, last = _parts(results, policy)
    return {"table.md": "\n".join(filter(None, others)), "differences.md": last}


def _parts(results: Results, policy: str) -> tuple[str, str, str, str]:
    """All tables under their headings, the differences last; empty where there is nothing."""
    parts = (
        (_REPRODUCTION, reproduction(results, policy)),
        (_HEADLINE, headline(results)),
        (_FORESTS, forests(results)),
        (_DIFFERENCES, differences(results, policy)),
    )
    first, second, third, fourth = (words + table if table else "" for words, table in parts)
    return first, second, third, fourth


def text(
    results: Results,
    policy: str,
    panels: Mapping[str, Panel | str],
    *,
    readme: Path,
    training: Mapping[Path, str],
) -> str:
    """Writes what stands between the marks of the README.

    Args:
        results: what was read.
        policy: name of the learned policy.
        panels: every figure.
        readme: the file, to which the links are relative.
        training: commands of the trainings, by the file of their metrics.
    """
    reproduced, best, others, pairs = _parts(results, policy)
    parts = [part for part in (reproduced, best, pairs, others) if part]
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
