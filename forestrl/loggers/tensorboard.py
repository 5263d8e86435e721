"""Metrics as TensorBoard event files."""

from __future__ import annotations

from forestrl.loggers.run import NoLogger, Run


class TensorboardLogger(NoLogger):
    """Writes the scalars as TensorBoard event files; pictures stay in the run folder.

    Going on with a run hides what lies behind the point where it goes on.

    Args:
        run: gives the folder, and the frames that the run goes on from.
    """

    def __init__(self, run: Run) -> None:
        from torch.utils.tensorboard import SummaryWriter

        purge = run.frames + 1 if run.frames else None
        self.writer = SummaryWriter(str(run.folder / "tensorboard"), purge_step=purge)

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Adds a point to every curve."""
        for name, value in metrics.items():
            if value == value:
                self.writer.add_scalar(name, value, step)

    def close(self, failed: bool = False) -> None:
        """Flushes the files."""
        self.writer.close()
