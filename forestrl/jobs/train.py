"""A training from the first frame to the last: ``forestrl train``."""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch
from omegaconf import DictConfig
from tensordict import TensorDictBase

from forestrl import build, records
from forestrl.command import configuration, keep, run_folder, typed
from forestrl.evaluation.episodes import evaluate
from forestrl.evaluation.metrics import eval_metrics
from forestrl.evaluation.picture import Player, draw_episode
from forestrl.jobs import search
from forestrl.learning.checkpoint import (
    load_training,
    restore_training,
    save_training,
    training_state,
)
from forestrl.learning.metrics import summarize
from forestrl.learning.ppo import NotFiniteError
from forestrl.policies.files import POLICY_FILE, save_policy
from forestrl.progress import Progress
from forestrl.stopping import check, saved
from forestrl.storage import atomic_file

_BATCH_FILE = "not_finite.pt"


class Training:
    """A training run: everything that lives from the first frame to the last.

    Args:
        cfg: the whole configuration.
        run_dir: where metrics, checkpoints and pictures go.
    """

    def __init__(self, cfg: DictConfig, run_dir: Path) -> None:
        torch.manual_seed(cfg.seed)
        self.cfg, self.run_dir = cfg, run_dir
        self.networks = build.make_networks(cfg)
        self.ppo = build.make_ppo(cfg, self.networks)
        self.env = build.make_training_env(cfg)
        build.check_model(cfg, self.networks, self.env)
        self.collector = build.make_collector(cfg, self.env, self.ppo.actor)
        self.policy = self.networks.make_policy()
        self.frames, self.best = 0, float("-inf")
        self.before = self._state()
        """The training as it stood before the update that goes on."""

    @property
    def total_frames(self) -> int:
        """Frames of the whole training: whole batches, at least as many as asked for."""
        batch = self.cfg.algo.frames_per_batch
        return -(-self.cfg.total_frames // batch) * batch

    def resume(self) -> None:
        """Goes on from the run folder's latest checkpoint; from the start if it has none."""
        state = load_training(self.run_dir / "checkpoints" / "latest")
        if state is not None:
            self._restore(state)

    def _state(self) -> dict[str, Any]:
        progress = {"frames": self.frames, "best": self.best}
        return training_state(self.ppo, self.collector, progress)

    def _restore(self, state: dict[str, Any]) -> None:
        progress = restore_training(state, self.ppo, self.collector)
        self.frames, self.best, self.before = progress["frames"], progress["best"], state

    def run(self, logger: Any, bar: Progress) -> dict[str, float]:
        """Trains to the end; returns the last metrics."""
        metrics: dict[str, float] = {}
        collected = iter(self.collector)
        while self.frames < self.total_frames:
            check()
            self.before = self._state()
            start = time.perf_counter()
            batch = next(collected)
            middle = time.perf_counter()
            metrics = summarize(batch, self.env.transform) | self.ppo.update(batch)
            end = time.perf_counter()
            self.frames += batch.numel()
            metrics |= _timing(batch, middle - start, end - middle)
            if self._due(self.cfg.eval.every):
                metrics |= self.evaluate(logger)
            logger.log_metrics(metrics, step=self.frames)
            bar.update(self.frames, metrics)
            if self.frames >= self.total_frames:
                self.save("latest", logger)
            elif self._due(self.cfg.checkpoint_every):
                with self._lasting():
                    self.save("latest", logger)
        return metrics

    @contextmanager
    def _lasting(self) -> Iterator[None]:
        """Goes on where a checkpoint on the way cannot be written, as on a full disk."""
        try:
            yield
        except OSError as error:
            print(f"no checkpoint at frame {self.frames:,}: {error}", file=sys.stderr)

    def rewind(self, logger: Any) -> None:
        """Saves the training as it stood before the update that was cut short."""
        self._restore(self.before)
        self.save("latest", logger)

    def _due(self, every: int) -> bool:
        """Tells whether a multiple of ``every`` was passed in this update, or the end reached."""
        if every <= 0:
            return False
        passed = self.frames // every > (self.frames - self.cfg.algo.frames_per_batch) // every
        return passed or self.frames >= self.total_frames

    def evaluate(self, logger: Any) -> dict[str, float]:
        """Measures the policy on the fixed arenas; keeps it if it is the best so far."""
        cfg = self.cfg.eval
        episodes = evaluate(
            lambda n: build.make_env(self.cfg, num_envs=n),
            self.policy,
            seed=cfg.seed,
            indices=range(cfg.arenas),
            steps=cfg.steps,
            batch=cfg.arenas,
        )
        metrics = eval_metrics(episodes)
        if metrics["eval/auc"] > self.best:
            with self._lasting():
                self.save("best", logger)
                self.best = metrics["eval/auc"]
        return metrics

    def draw(self, logger: Any) -> None:
        """Draws an episode in the first of the fixed arenas."""
        cfg, path = self.cfg.eval, self.run_dir / "episode.gif"
        steps = min(cfg.steps, 500)
        player = Player(build.make_env(self.cfg, num_envs=1), self.policy)
        draw_episode({"policy": player}, path, seed=cfg.seed, arena=0, steps=steps, every=5)
        logger.log_figure("eval/episode", path, step=self.frames)

    def save(self, alias: str, logger: Any) -> None:
        """Writes the policy, and for the latest the training state beside it."""
        folder = self.run_dir / "checkpoints" / alias
        folder.mkdir(parents=True, exist_ok=True)
        about = {"frames": self.frames, "seed": self.cfg.seed}
        save_policy(folder / POLICY_FILE, build.to_policy(self.cfg, self.networks, about))
        if alias == "latest":
            save_training(folder, self._state())
        if alias == "best" or self.frames >= self.total_frames:
            logger.log_policy(folder / POLICY_FILE, [alias])


def _timing(batch: TensorDictBase, collect: float, update: float) -> dict[str, float]:
    """Gives frames per second, seconds of each part, and the peak of memory in GB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return {
        "time/fps": batch.numel() / (collect + update),
        "time/collect": collect,
        "time/update": update,
        "time/memory": peak,
    }


def why_not(name: str) -> str | None:
    """Says why a setting of a training cannot be changed on the way; None if it can."""
    if name == "seed":
        return "its sources of randomness go on where they were"
    return "another method begins anew" if name in ("algo", "algo._target_") else None


def run(cfg: DictConfig) -> float:
    """Trains for ``cfg.total_frames``; returns the mean coverage for sweepers.

    It is that of the last evaluation or, if there is none, of the last episodes; nan if there was
    nothing left to train.
    """
    run_dir, asked = run_folder(cfg), cfg
    cfg = configuration(asked, run_dir, why_not)
    if search.is_search(cfg):
        return search.run(configuration(asked, run_dir, search.why_not), run_dir)
    build.prepare(cfg)
    training = Training(cfg, run_dir)
    training.resume()
    done = records.finished(run_dir)
    if done is not None and training.frames >= training.total_frames:
        print(f"{run_dir}: finished, there is nothing left to do")
        return done["result"]
    keep(cfg, run_dir)
    logger = build.make_logger(cfg, run_dir, training.frames)
    failed = True
    try:
        with Progress(training.total_frames, training.frames) as bar, kept(training, logger):
            metrics = training.run(logger, bar)
        if cfg.eval.every > 0:
            training.draw(logger)
        failed = False
    finally:
        saved()
        training.collector.shutdown()
        logger.close(failed)
    print(bar.summary(metrics))
    print(f"\nnext: forestrl eval {typed('checkpoint', run_dir)}")
    return metrics.get("eval/coverage", metrics.get("rollout/coverage", float("nan")))


@contextmanager
def kept(training: Training, logger: Any) -> Iterator[None]:
    """Saves a training that is cut short, by a signal or an error, as it stood before the update.

    Raises:
        ValueError: in place of a ``NotFiniteError``, saying where its batch is.
    """
    try:
        yield
    except BaseException as error:
        frame = training.frames
        try:
            training.rewind(logger)
        except Exception as another:
            print(f"no checkpoint at frame {training.frames:,}: {another}", file=sys.stderr)
        if not isinstance(error, NotFiniteError):
            raise
        with atomic_file(training.run_dir / _BATCH_FILE) as file:
            torch.save(dict(error.batch.flatten_keys("/").items()), file)
        again = f"forestrl train {typed('resume', training.run_dir)} algo.lr=..."
        raise ValueError(
            f"{error} in the update after frame {frame:,}; the batch is in {_BATCH_FILE}, the "
            f"checkpoint is from before it; to go on with other settings: {again}"
        ) from error
