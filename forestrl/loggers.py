"""Where metrics go: a CSV file, and a dashboard beside it if one is asked for."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from forestrl.storage import atomic_write


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
    """Writes nothing."""

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
        path: the file.
        frames: frames the run goes on from; 0 for a new one.
    """

    def __init__(self, path: Path, frames: int = 0) -> None:
        self.path, self.columns, self.rows = path, ["frames"], []
        if frames and path.exists():
            with path.open(newline="") as file:
                reader = csv.DictReader(file)
                self.columns = list(reader.fieldnames or self.columns)
                self.rows = [row for row in reader if int(row["frames"]) <= frames]
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
    """Writes the scalars as TensorBoard event files; pictures stay in the run folder."""

    def __init__(self, folder: Path) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self.writer = SummaryWriter(str(folder))

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

    Args:
        folder: where the ``wandb`` folder goes; jobs of one sweep share it.
        config: the resolved configuration.
        settings: further arguments of ``wandb.init``.
    """

    def __init__(self, folder: Path, config: dict[str, Any], **settings: Any) -> None:
        import wandb

        self.wandb = wandb
        mode: Any = os.environ.get("WANDB_MODE") or ("online" if _logged_in() else "offline")
        folder.mkdir(parents=True, exist_ok=True)
        self.run = wandb.init(dir=str(folder), config=config, mode=mode, **settings)
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
