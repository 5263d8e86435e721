"""Where metrics go: a CSV file, and a dashboard beside it if one is asked for."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from forestrl.settings import checked
from forestrl.storage import atomic_write


@dataclass(frozen=True)
class Run:
    """What a logger is told of the run: its first argument, before its own settings."""

    folder: Path
    """The run folder."""
    frames: int = 0
    """Frames the run goes on from; 0 for a new one."""
    id: str | None = None
    """The dashboard's id of the run that goes on."""
    config: Mapping[str, Any] = field(default_factory=dict)
    """The resolved configuration."""
    command: str = "train"
    overrides: tuple[str, ...] = ()
    sweep: Path | None = None
    """The folder of the sweep whose job this is."""
    experiment: str | None = None


class Logger(Protocol):
    """What every logger does; ``step`` is counted in frames."""

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Takes scalars by name."""

    def log_figure(self, name: str, path: Path, step: int) -> None:
        """Takes a picture or an animation from a file."""

    def log_table(self, name: str, path: Path) -> None:
        """Takes a table from a CSV file."""

    def log_policy(self, path: Path, aliases: Sequence[str]) -> None:
        """Takes a policy file, to be found again by its aliases."""

    def close(self, failed: bool = False) -> None:
        """Ends the run."""


class NoLogger:
    """Writes nothing.

    Args:
        run: the run.
    """

    def __init__(self, run: Run | None = None) -> None: ...

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Ignores the metrics."""

    def log_figure(self, name: str, path: Path, step: int) -> None:
        """Ignores the picture."""

    def log_table(self, name: str, path: Path) -> None:
        """Ignores the table."""

    def log_policy(self, path: Path, aliases: Sequence[str]) -> None:
        """Ignores the policy."""

    def close(self, failed: bool = False) -> None:
        """Does nothing."""


class CsvLogger(NoLogger):
    """Writes ``metrics.csv``, a row a call, the first column the frames.

    A metric that appears later adds a column; a value that is missing or nan is left empty. Going
    on with a run keeps its rows up to the point where it goes on.

    Args:
        run: gives the folder, and the frames that the run goes on from.
    """

    def __init__(self, run: Run) -> None:
        self.path, self.columns, self.rows = run.folder / "metrics.csv", ["frames"], []
        if run.frames and self.path.exists():
            with self.path.open(newline="") as file:
                reader = csv.DictReader(file)
                self.columns = list(reader.fieldnames or self.columns)
                self.rows = [row for row in reader if int(row["frames"]) <= run.frames]
        self._rewrite()

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Appends a row."""
        row = {name: f"{value:.6g}" for name, value in metrics.items() if value == value}
        self.rows.append({"frames": str(step), **row})
        if new := [name for name in metrics if name not in self.columns]:
            self.columns += new
            self._rewrite()
        else:
            with self.path.open("a", newline="") as file:
                csv.DictWriter(file, self.columns, restval="").writerow(self.rows[-1])

    def _rewrite(self) -> None:
        table = io.StringIO(newline="")
        writer = csv.DictWriter(table, self.columns, restval="")
        writer.writeheader()
        writer.writerows(self.rows)
        atomic_write(self.path, table.getvalue())


class TensorboardLogger(NoLogger):
    """Writes the scalars as TensorBoard event files; pictures stay in the run folder.

    Args:
        run: gives the folder.
    """

    def __init__(self, run: Run) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self.writer = SummaryWriter(str(run.folder / "tensorboard"))

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Adds a point to every curve."""
        for name, value in metrics.items():
            if value == value:
                self.writer.add_scalar(name, value, step)

    def close(self, failed: bool = False) -> None:
        """Flushes the files."""
        self.writer.close()


class WandbLogger(NoLogger):
    """Writes a Weights & Biases run, offline unless the user is logged in or says otherwise.

    The run is named after its overrides; the jobs of a sweep share one folder and one group.

    Args:
        run: the run.
        project: on the dashboard.
        entity: team or user; None for the default.
        group: None for the sweep's folder, or the experiment.
        dir: where the ``wandb`` folder goes; None for the sweep's folder, or the run's.
    """

    @checked
    def __init__(
        self,
        run: Run,
        project: str = "forestrl",
        entity: str | None = None,
        group: str | None = None,
        dir: Path | None = None,
    ) -> None:
        import wandb

        self.wandb = wandb
        mode: Any = os.environ.get("WANDB_MODE") or ("online" if _logged_in() else "offline")
        folder = Path(dir) if dir else run.sweep or run.folder
        folder.mkdir(parents=True, exist_ok=True)
        self.run = wandb.init(
            dir=str(folder),
            config=dict(run.config),
            mode=mode,
            project=project,
            entity=entity,
            group=group or (run.sweep.name if run.sweep else run.experiment),
            job_type=run.command,
            name=",".join(run.overrides)[:120] or None,
            tags=[override[:64] for override in run.overrides],
            id=run.id,
            resume="allow" if run.id else None,
        )
        self.run.define_metric("frames")
        self.run.define_metric("*", step_metric="frames")

    @property
    def id(self) -> str:
        """The run's id, to go on with it."""
        return self.run.id

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Adds a row; nan is left out."""
        present = {name: value for name, value in metrics.items() if value == value}
        self.run.log({"frames": step, **present})

    def log_figure(self, name: str, path: Path, step: int) -> None:
        """Adds a picture or an animation."""
        animated = path.suffix == ".gif"
        media = (
            self.wandb.Video(str(path), format="gif") if animated else self.wandb.Image(str(path))
        )
        self.run.log({"frames": step, name: media})

    def log_table(self, name: str, path: Path) -> None:
        """Adds a table, a row a line of the file."""
        with path.open(newline="") as file:
            head, *rows = csv.reader(file)
        self.run.log({name: self.wandb.Table(columns=list(head), data=rows)})

    def log_policy(self, path: Path, aliases: Sequence[str]) -> None:
        """Adds the policy as an artifact."""
        artifact = self.wandb.Artifact(f"policy-{self.run.id}", type="model")
        artifact.add_file(str(path))
        self.run.log_artifact(artifact, aliases=list(aliases))

    def close(self, failed: bool = False) -> None:
        """Finishes the run, so that the next job of a sweep starts its own."""
        self.run.finish(exit_code=1 if failed else 0)


def _logged_in() -> bool:
    """Tells whether this user has a key, without asking the network."""
    if os.environ.get("WANDB_API_KEY"):
        return True
    netrc = Path(os.environ.get("NETRC", Path.home() / ".netrc"))
    return netrc.is_file() and "api.wandb.ai" in netrc.read_text(errors="ignore")


class Loggers:
    """Passes everything on to several loggers."""

    def __init__(self, *loggers: Logger) -> None:
        self.loggers = loggers

    @property
    def id(self) -> str | None:
        """The dashboard's id of the run, to go on with it; None without a dashboard."""
        return next((logger.id for logger in self.loggers if hasattr(logger, "id")), None)

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Passes the metrics on."""
        for logger in self.loggers:
            logger.log_metrics(metrics, step)

    def log_figure(self, name: str, path: Path, step: int) -> None:
        """Passes the picture on."""
        for logger in self.loggers:
            logger.log_figure(name, path, step)

    def log_table(self, name: str, path: Path) -> None:
        """Passes the table on."""
        for logger in self.loggers:
            logger.log_table(name, path)

    def log_policy(self, path: Path, aliases: Sequence[str]) -> None:
        """Passes the policy on."""
        for logger in self.loggers:
            logger.log_policy(path, aliases)

    def close(self, failed: bool = False) -> None:
        """Closes all."""
        for logger in self.loggers:
            logger.close(failed)
