"""A world as files of ROS's map_server: ``forestrl export``."""

from __future__ import annotations

from omegaconf import DictConfig

from forestrl import build
from forestrl.command import run_folder
from forestrl.envs import draw_map, write_map
from forestrl.evaluation.arenas import arena_generator
from forestrl.functional import Cell
from forestrl.jobs.worlds import say_world


def run(cfg: DictConfig) -> None:
    """Writes test arena ``cfg.export.arena`` as ``map.yaml`` and its image, and says the start."""
    folder, settings = run_folder(cfg), cfg.export
    build.prepare(cfg)
    say_world(cfg)
    generator = arena_generator(settings.seed, settings.arena, "arena")
    world = build.make_forest(cfg, 1).world
    grid, start = draw_map(world, generator, settings.cell_size)
    write_map(folder / "map.yaml", grid, settings.image)
    x, y = grid.point_at(*start.tolist())
    counts = ", ".join(f"{(grid.cells == state).sum()} {state.name.lower()}" for state in Cell)
    print(f"{grid.shape[0]} x {grid.shape[1]} cells of {grid.cell_size:g} m: {counts}")
    print(f"start: env.start=[{x:g},{y:g}] with env=map and env.reduce=1")
    print(f"map: {folder / 'map.yaml'}")
