"""Where metrics go: a CSV file, and a dashboard beside it if one is asked for."""

from forestrl.loggers.csv import CsvLogger
from forestrl.loggers.run import Logger, NoLogger, Run
from forestrl.loggers.several import Loggers
from forestrl.loggers.tensorboard import TensorboardLogger
from forestrl.loggers.wandb import WandbLogger

__all__ = [
    "CsvLogger",
    "Logger",
    "Loggers",
    "NoLogger",
    "Run",
    "TensorboardLogger",
    "WandbLogger",
]
