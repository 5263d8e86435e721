"""The pages of the results: docs/results.md, and the parts of the README that come from numbers."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from pathlib import Path

from forestrl.evaluation.reading import Evaluation, ResultError
from forestrl.publishing import statements, tables
from forestrl.publishing.catalogue import text
from forestrl.publishing.figures import Figure
from forestrl.publishing.results import Results, Training
from forestrl.sweeps import overrides

FIGURES = "figures"
"""The folder of the figures beside the settings."""


def page(
    results: Results, method: str, ablations: str, drawn: Mapping[str, Figure | str], path: Path
) -> str:
    """Writes the page of all results; a part that there is no data for is left out.

    Args:
        results: what was read.
        method: name of the paper's policy in the results.
        ablations: the table of the ablations.
        drawn: every figure.
        path: of the page, to which its links are relative.
    """
    found = {
        "summary": statements.summary(results, method),
        "reproduction": statements.reproduction(results, method),
        "headline": tables.headline(results),
        "endings": tables.endings(results),
        "differences": tables.differences(results, method),
        "forests": tables.forests(results),
        "ablations": ablations,
        "learning": tables.learning(results),
        "figures": _figures(results, drawn, path),
    }
    parts = [part for part in text("results.md").split("\n## ") if part]
    written = [parts[0]]
    for part in parts[1:]:
        name = part[part.index("{") + 1 : part.index("}")]
        if found[name]:
            written.append(part.replace(f"{{{name}}}", found[name].strip()))
    return "\n## ".join(written).rstrip() + "\n"


def _figures(results: Results, drawn: Mapping[str, Figure | str], path: Path) -> str:
    """Every figure with its caption and the commands that made its data."""
    parts = []
    for name, figure in drawn.items():
        if not isinstance(figure, Figure):
            continue
        link = Path(
            os.path.relpath(results.folder / FIGURES / f"{name}.png", path.parent)
        ).as_posix()
        lines = dict.fromkeys(_data_command(each) for each in figure.sources)
        commands, title = "\n".join(lines), f"Fig. {name.removeprefix('fig')}"
        parts.append(
            f'<img src="{link}" width="440" alt="{title}">\n\n**{title}.** {figure.caption}\n\n'
            f"<details><summary>commands</summary>\n\n```bash\n{commands}\n```\n\n</details>\n"
        )
    return "\n".join(parts)


def _data_command(source: Evaluation | Training) -> str:
    """The command that made the data; an evaluation writes them where they are."""
    if isinstance(source, Training):
        written = source.path.with_suffix(".yaml")
        if written.is_file():
            return shlex.join(["forestrl", "train", *overrides(written)])
        return f"# {source.path.as_posix()}: command not recorded"
    folder = source.folder.as_posix()
    if (command := source.meta.get("command")) is None:
        return f"# {folder}: command not recorded"
    return f"{command} {shlex.quote(f'hydra.run.dir={folder}')}"


def readme_parts(results: Results, method: str) -> dict[str, str]:
    """Writes what the README says in numbers: its table, by the name of its marks."""
    return {"table": tables.short(results)}


def replace_between_marks(old: str, name: str, new: str) -> str:
    """Puts a text between the marks of a name; everything else stays.

    Args:
        old: the whole file.
        name: of the marks, ``<!-- name -->`` and ``<!-- /name -->``.
        new: what belongs between them.

    Raises:
        ResultError: if the marks are not there once each, in order.
    """
    start, end = f"<!-- {name} -->", f"<!-- /{name} -->"
    if old.count(start) != 1 or old.count(end) != 1 or old.index(start) > old.index(end):
        raise ResultError(f"the README wants {start} and, after it, {end}, once each")
    before, _, rest = old.partition(start)
    return f"{before}{start}\n\n{new.strip()}\n\n{end}{rest.partition(end)[2]}"
