"""Draws the figures and tables from their result files: ``python -m forestrl.figures``."""

from __future__ import annotations

import shlex
from pathlib import Path

from omegaconf import DictConfig, OmegaConf

from forestrl.command import command
from forestrl.publishing.drawing import files
from forestrl.publishing.files import ResultError
from forestrl.publishing.panel import Panel
from forestrl.publishing.panels import panels
from forestrl.publishing.readme import replace_between_marks, tables, text
from forestrl.publishing.results import ABLATIONS, FIGURES, Results, read_results
from forestrl.publishing.sweeps import Job, aggregate
from forestrl.storage import atomic_write


@command("figures")
def main(cfg: DictConfig) -> None:
    """Redraws ``cfg.results``, or sums up the sweep in ``cfg.sweep``."""
    if cfg.sweep is not None:
        sum_up(Path(str(cfg.sweep)))
    else:
        publish(cfg)


def publish(cfg: DictConfig) -> None:
    """Writes figures and tables beside the results, and both into the README."""
    folder = Path(str(cfg.results))
    if not folder.is_dir():
        raise ResultError(f"results={folder} is not a folder")
    results = read_results(folder)
    drawn = panels(results, cfg.policy)
    (folder / FIGURES).mkdir(exist_ok=True)
    for name, panel in drawn.items():
        if isinstance(panel, Panel):
            for kind, data in files(panel.draw).items():
                print(atomic_write(folder / FIGURES / f"{name}.{kind}", data))
        else:
            print(f"{name} skipped: it wants, in {folder}, {panel}")
    jobs = _jobs(folder / ABLATIONS)
    ablations = aggregate(jobs).markdown if jobs else ""
    for name, table in tables(results, cfg.policy, ablations).items():
        if table:
            print(atomic_write(folder / name, table))
    if cfg.readme is not None:
        readme = Path(str(cfg.readme))
        commands = _commands(results)
        new = text(results, cfg.policy, ablations, drawn, readme=readme, training=commands)
        print(atomic_write(readme, replace_between_marks(_read(readme), new)))


def sum_up(folder: Path) -> None:
    """Prints a sweep's table and writes it into the sweep's folder."""
    jobs = _jobs(folder)
    if not jobs:
        raise ResultError(f"sweep={folder} holds no job: it wants <job>/.hydra/overrides.yaml")
    sweep = aggregate(jobs)
    print(sweep.markdown)
    for line in sweep.skipped:
        print(f"skipped: {line}")
    print(atomic_write(folder / "table.md", sweep.markdown))
    print(atomic_write(folder / "table.csv", sweep.csv))


def _jobs(folder: Path) -> list[Job]:
    """The jobs of a sweep's folder, in their order: 2 before 10."""
    found = folder.glob("*/.hydra/overrides.yaml")
    paths = sorted(found, key=lambda path: (len(path.parents[1].name), path.parents[1].name))
    return [Job(path.parents[1], _overrides(path)) for path in paths]


def _commands(results: Results) -> dict[Path, str]:
    """The commands of the trainings: overrides lie beside the metrics, as ``seed<N>.yaml``."""
    paths = [training.path for training in results.training.values()]
    there = [path for path in paths if path.with_suffix(".yaml").is_file()]
    return {path: _train_command(path) for path in there}


def _train_command(path: Path) -> str:
    return shlex.join(["forestrl", "train", *_overrides(path.with_suffix(".yaml"))])


def _overrides(path: Path) -> list[str]:
    """A job's overrides as Hydra wrote them."""
    overrides = OmegaConf.to_container(OmegaConf.load(path))
    if not isinstance(overrides, list):
        raise ResultError(f"{path} is not a list of overrides")
    return [str(override) for override in overrides]


def _read(path: Path) -> str:
    if not path.is_file():
        raise ResultError(f"readme={path} is not a file; readme=null writes none")
    return path.read_bytes().decode()


if __name__ == "__main__":
    main()
