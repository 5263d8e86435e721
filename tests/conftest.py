"""Settings of the whole suite: one thread, and hypothesis profiles."""

from __future__ import annotations

import logging
import os

import torch
from hypothesis import settings

settings.register_profile("local", max_examples=20, deadline=None)
settings.register_profile("ci", max_examples=20, deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")

torch.set_num_threads(1)  # small arenas: a second thread costs more than it gives
logging.getLogger("torchrl").setLevel(logging.WARNING)
