"""Direct search for the weights of the linear score: covariance matrix adaptation (CMA-ES)."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch

from forestrl.explorer.network import LinearScore
from forestrl.explorer.training.task import Task, Told
from forestrl.settings import Range, checked
from forestrl.storage import atomic_write

_FILE = "search.jsonl"


class WeightSearch:
    """Searches for weights that take few steps.

    In every generation all members explore the same fresh arenas; now and then the mean of the
    distribution explores the validation arenas, and the best mean is kept. Costs are kept in
    ``search.jsonl``: a search that goes on asks for the same members again and tells their costs
    from there, so that it ends as if it had never stopped.

    Args:
        generations: of the search.
        population: members of each.
        arenas: that a member explores.
        spread: standard deviation of the first generation.
        validate_every: generations between looks at the validation arenas.
    """

    unit = "generation"

    @checked
    def __init__(
        self,
        generations: Annotated[int, Range(1, 10_000)] = 48,
        population: Annotated[int, Range(4, 1000)] = 14,
        arenas: Annotated[int, Range(1, 100_000)] = 80,
        spread: Annotated[float, Range(above=0, high=10)] = 0.3,
        validate_every: Annotated[int, Range(1, 10_000)] = 4,
    ) -> None:
        self.total, self.population, self.arenas = generations, population, arenas
        self.spread, self.validate_every = spread, validate_every

    def run(self, network: LinearScore, task: Task, folder: Path) -> Iterator[Told]:
        """Searches from the network's weights on, or goes on with what the folder keeps.

        Raises:
            ModuleNotFoundError: if the library that searches is not installed.
            ValueError: if the network is not a linear score.
        """
        if not isinstance(network, LinearScore):
            raise ValueError(
                f"model={type(network).__name__} is not allowed: this searches a "
                "LinearScore: choose experiment=linear"
            )
        import cma  # here, as only the extra "search" installs it

        options = {"popsize": self.population, "seed": task.seed + 1, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(network.weights.tolist(), self.spread, options)
        known, best = _read(folder / _FILE), np.inf
        for generation in range(1, self.total + 1):
            members = strategy.ask()
            new = generation > len(known)
            row = (
                self._explore(generation, members, network, task) if new else known[generation - 1]
            )
            metrics = row["metrics"]
            if new:
                metrics["search/spread"] = float(strategy.sigma)
            strategy.tell(members, row["costs"])
            middle = _with_weights(network, strategy.result.xfavorite)
            if new:
                if generation % self.validate_every == 0 or generation == self.total:
                    found = task.steps(middle.pack(), task.validation)
                    metrics["eval/steps"] = float(found.mean())
                known.append(row)
                lines = "".join(json.dumps(one) + "\n" for one in known)
                atomic_write(folder / _FILE, lines)
            improved = metrics.get("eval/steps", np.inf) < best
            best = min(best, metrics.get("eval/steps", np.inf))
            yield Told(generation, metrics, middle if improved else None)

    def _explore(
        self, generation: int, members: list[Any], network: LinearScore, task: Task
    ) -> dict[str, Any]:
        """Lets all members explore the same fresh arenas."""
        arenas, _ = task.draw(self.arenas, generation)
        costs = [
            float(task.steps(_with_weights(network, member).pack(), arenas).mean())
            for member in members
        ]
        metrics = {"search/steps": float(np.mean(costs)), "search/best": float(np.min(costs))}
        return {"costs": costs, "metrics": metrics}


def _with_weights(network: LinearScore, weights: Any) -> LinearScore:
    changed = copy.deepcopy(network)
    changed.weights.copy_(torch.as_tensor(np.asarray(weights)))
    return changed


def _read(path: Path) -> list[dict[str, Any]]:
    """The generations that are kept; a damaged line and all behind it are measured again."""
    rows: list[dict[str, Any]] = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else []:
        try:
            rows.append(json.loads(line))
        except ValueError:
            break
    return rows
