"""Figures and tables drawn from their result files: ``forestrl figures``."""

from __future__ import annotations

from pathlib import Path

from omegaconf import DictConfig

from forestrl.evaluation.reading import ResultError
from forestrl.publishing.drawing import files
from forestrl.publishing.figures import Figure, figures
from forestrl.publishing.page import FIGURES, page, readme_parts, replace_between_marks
from forestrl.publishing.results import read_results
from forestrl.storage import atomic_write
from forestrl.sweeps import aggregate

_ABLATIONS = "ablations"  # a sweep beside the settings


def run(cfg: DictConfig) -> None:
    """Redraws ``cfg.results``, or sums up the sweep in ``cfg.sweep``."""
    if cfg.sweep is not None:
        sum_up(Path(str(cfg.sweep)))
    else:
        publish(cfg)


def publish(cfg: DictConfig) -> None:
    """Draws the figures beside the results, and writes the page and the README's numbers."""
    folder = Path(str(cfg.results))
    if not folder.is_dir():
        raise ResultError(f"results={folder} is not a folder")
    results = read_results(folder)
    known = sorted({name for methods in results.settings.values() for name in methods})
    if known and cfg.method not in known:
        raise ResultError(f"method={cfg.method} is not in {folder}: it has {', '.join(known)}")
    drawn = figures(results, cfg.method)
    (folder / FIGURES).mkdir(exist_ok=True)
    for name, figure in drawn.items():
        if isinstance(figure, Figure):
            for kind, data in files(figure.draw).items():
                print(atomic_write(folder / FIGURES / f"{name}.{kind}", data))
        else:
            print(f"{name} skipped: it wants, in {folder}, {figure}")
    if cfg.page is not None:
        ablations = aggregate(folder / _ABLATIONS) if (folder / _ABLATIONS).is_dir() else None
        path, table = Path(str(cfg.page)), "" if ablations is None else ablations.markdown
        print(atomic_write(path, page(results, cfg.method, table, drawn, path)))
    if cfg.readme is not None:
        path = Path(str(cfg.readme))
        text = _read(path)
        for name, part in readme_parts(results, cfg.method).items():
            text = replace_between_marks(text, name, part)
        print(atomic_write(path, text))


def sum_up(folder: Path) -> None:
    """Prints a sweep's table and writes it into the sweep's folder."""
    sweep = aggregate(folder)
    print(sweep.markdown)
    for line in sweep.skipped:
        print(f"skipped: {line}")
    print(atomic_write(folder / "table.md", sweep.markdown))
    print(atomic_write(folder / "table.csv", sweep.csv))


def _read(path: Path) -> str:
    if not path.is_file():
        raise ResultError(f"readme={path} is not a file; readme=null writes none")
    return path.read_bytes().decode()
