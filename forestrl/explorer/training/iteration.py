"""Policy iteration for the explorer: episodes, what else could have been done, a better policy."""

from __future__ import annotations

import io
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import torch

from forestrl.explorer.network import LinearScore, ViewpointGATv2
from forestrl.explorer.training.improvement import Fit, improve, normalize
from forestrl.explorer.training.outcomes import Outcomes, gather
from forestrl.explorer.training.task import LIMIT, Task, Told
from forestrl.settings import Range, checked
from forestrl.storage import atomic_write

_CHUNK = 100  # arenas that are kept as one file
Count = Annotated[int, Range(1, 1_000_000)]


class PolicyIteration:
    """Improves on a policy by the outcomes of choices it could have made.

    In each round the policy explores arenas. At some of the steps several candidates are tried to
    the end, from the same state in the same arena; the network is fitted to the differences, and is
    the policy of the next round if it takes fewer steps on the validation arenas. The first round
    begins with the linear score.

    Args:
        start: a linear score.
        rounds: of episodes and fits.
        arenas: explored in a round; a multiple of 100.
        rate: share of the steps at which candidates are tried.
        options: candidates tried at such a step, the policy's own choice among them.
        epochs: of a fit.
        batch: states of a minibatch.
        lr: learning rate.
        sharpness: the policy is taken as the softmax of that many times the scores.
        trust: weight of the divergence from the policy that explored.

    Raises:
        ValueError: if a value is out of its range.
    """

    unit = "arena"

    @checked
    def __init__(
        self,
        start: LinearScore,
        rounds: Annotated[int, Range(1, 100)] = 3,
        arenas: Annotated[int, Range(100, 10_000_000)] = 500,
        rate: Annotated[float, Range(above=0, high=1)] = 0.03,
        options: Annotated[int, Range(2, 64)] = 5,
        epochs: Count = 8,
        batch: Count = 512,
        lr: Annotated[float, Range(above=0, high=1)] = 1e-3,
        sharpness: Annotated[float, Range(above=0, high=1000)] = 3.0,
        trust: Annotated[float, Range(0, 1000)] = 0.3,
    ) -> None:
        if arenas % _CHUNK:
            raise ValueError(f"arenas={arenas} is not allowed: it must be a multiple of {_CHUNK}")
        self.start, self.rounds, self.arenas = start, rounds, arenas
        self.rate, self.options = rate, options
        self.fit = Fit(epochs, batch, lr, sharpness=sharpness, trust=trust)
        self.total = rounds * arenas

    def run(self, network: ViewpointGATv2, task: Task, folder: Path) -> Iterator[Told]:
        """Trains; what is kept in the folder lets an interrupted training go on.

        Raises:
            ValueError: if the network compares no viewpoints.
        """
        if not isinstance(network, ViewpointGATv2):
            raise ValueError(
                f"model={type(network).__name__} is not allowed: this trains a "
                "ViewpointGATv2: choose experiment=explorer"
            )
        network.linear.copy_(self.start.weights)
        best = task.steps(self.start.pack(), task.validation)
        yield Told(0, {"eval/steps": float(best.mean())}, network)
        for number in range(1, self.rounds + 1):
            parts = []
            for part in range(self.arenas // _CHUNK):
                path = folder / "outcomes" / f"{number}-{part}.npz"
                parts.append(self._part(path, network, task, number, part))
                yield Told((number - 1) * self.arenas + (part + 1) * _CHUNK, {}, None)
            outcomes = Outcomes(*(np.concatenate(values) for values in zip(*parts, strict=True)))
            if number == 1:
                normalize(network, outcomes)
            generator = torch.Generator().manual_seed(task.seed)
            improved = improve(network, outcomes, self.fit, generator)
            steps = task.steps(improved.pack(), task.validation)
            metrics = {
                "outcomes/states": float(len(outcomes.steps)),
                "eval/steps": float(steps.mean()),
                "eval/gain": float((steps - best).mean()),
            }
            better = steps.mean() < best.mean()
            if better:
                network, best = improved, steps
            yield Told(number * self.arenas, metrics, network if better else None)
        shutil.rmtree(folder / "outcomes")

    def _part(
        self, path: Path, network: ViewpointGATv2, task: Task, number: int, part: int
    ) -> Outcomes:
        """Gathers the outcomes of a hundred arenas, or finds them where they are kept."""
        try:
            with np.load(path, allow_pickle=False) as kept:
                return Outcomes(*(kept[name] for name in Outcomes._fields))
        except (OSError, KeyError, ValueError, zipfile.BadZipFile):
            pass
        arenas, generator = task.draw(_CHUNK, number, part)
        outcomes = gather(
            *arenas,
            torch.randint(2**31, (_CHUNK,), generator=generator).numpy(),
            lidar_range=task.lidar_range,
            weights=network.pack(),
            coverage_goal=task.coverage_goal,
            rate=self.rate,
            options=self.options,
            limit=LIMIT,
        )
        data = io.BytesIO()
        np.savez_compressed(data, **outcomes._asdict())
        path.parent.mkdir(exist_ok=True)
        atomic_write(path, data.getvalue())
        return outcomes
