"""Metrics, pictures and policies as a Weights & Biases run, with or without account and network."""

from __future__ import annotations

import csv
import os
import sys
import urllib.error
import urllib.request
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from forestrl.loggers.run import NoLogger, Run
from forestrl.settings import checked

_OFFLINE: Any = "offline"
_SECONDS_TO_ANSWER = 5
_TIMEOUTS: dict[str, Any] = {
    "init_timeout": 30,
    "login_timeout": 10,
    "finish_timeout": 300,
}  # s, not for ever


class WandbLogger(NoLogger):
    """Writes a Weights & Biases run, offline unless the user is logged in and there is a network.

    It never asks for anything at a prompt. The run is named after its overrides; the jobs of a
    sweep share one folder and one group. A run that goes on keeps its id, so that what was written
    offline in several goes is one history when it is synced.

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
        folder = Path(dir) if dir else run.sweep or run.folder
        folder.mkdir(parents=True, exist_ok=True)
        about: dict[str, Any] = {
            "dir": str(folder),
            "config": dict(run.config),
            "project": project,
            "entity": entity,
            "group": group or (run.sweep.name if run.sweep else run.experiment),
            "job_type": run.command,
            "name": ",".join(run.overrides)[:120] or None,
            "tags": [override[:64] for override in run.overrides],
            "id": run.id,
            "resume": "allow" if run.id else None,
        }
        self.run = self._begun(_mode(), about)
        self.run.define_metric("frames")
        self.run.define_metric("*", step_metric="frames")

    def _begun(self, mode: Any, about: dict[str, Any]) -> Any:
        """Begins the run; offline where it cannot be begun as asked."""
        settings = self.wandb.Settings(**_TIMEOUTS)
        try:
            return self.wandb.init(**about, mode=mode, settings=settings)
        except Exception as error:
            if mode == _OFFLINE:
                raise
            _say(" ".join(str(error).split()))
            self.wandb.teardown()
            return self.wandb.init(**about, mode=_OFFLINE, settings=settings)

    @property
    def id(self) -> str:
        """The run's id, to go on with it."""
        return self.run.id

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Adds a row; nan is left out."""
        present = {name: value for name, value in metrics.items() if value == value}
        self.run.log({"frames": step, **present}, step=step)

    def log_figure(self, name: str, path: Path, step: int) -> None:
        """Adds a picture or an animation."""
        animated = path.suffix == ".gif"
        media = (
            self.wandb.Video(str(path), format="gif") if animated else self.wandb.Image(str(path))
        )
        self.run.log({"frames": step, name: media}, step=step)

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


def _mode() -> Any:
    """The mode that was asked for, or the nearest that needs no prompt and no waiting."""
    asked = os.environ.get("WANDB_MODE", "")
    if asked not in ("", "online"):
        return asked
    host = service()
    if not logged_in(host):
        if asked:
            _say(f"WANDB_MODE={asked} needs a login, see wandb login")
        return _OFFLINE
    if not _answers(host):
        _say(f"{host} does not answer")
        return _OFFLINE
    return asked or "online"


def _say(why: str) -> None:
    print(f"wandb: {why}: the run is written offline, to be sent by wandb sync", file=sys.stderr)


def service() -> str:
    """Gives the address of the service that is asked for."""
    return os.environ.get("WANDB_BASE_URL") or "https://api.wandb.ai"


def logged_in(host: str) -> bool:
    """Tells whether this user has a key, without asking the network."""
    if os.environ.get("WANDB_API_KEY"):
        return True
    netrc = Path(os.environ.get("NETRC") or os.path.expanduser("~/.netrc"))
    name = host.partition("://")[2].partition(":")[0].strip("/")
    try:
        return name in netrc.read_text(errors="ignore")
    except OSError:
        return False


def _answers(host: str) -> bool:
    """Tells whether a host answers, in whatever words."""
    try:
        urllib.request.urlopen(host, timeout=_SECONDS_TO_ANSWER).close()
    except urllib.error.HTTPError:
        return True
    except OSError:
        return False
    return True
