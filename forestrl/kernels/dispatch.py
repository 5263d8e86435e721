"""The one place that decides between a compiled function and its reference in torch."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from torch import Tensor

R = TypeVar("R")


def by_device(compiled: Callable[..., R], reference: Callable[..., R]) -> Callable[..., R]:
    """Takes the compiled version for CPU tensors and the reference for all others.

    Args:
        compiled: for the CPU.
        reference: of the same signature, for every device.

    Returns:
        a function of that signature, which looks at its first argument, a tensor.
    """

    @wraps(reference)
    def choose(first: Tensor, *args: object, **kwargs: object) -> R:
        version = compiled if first.device.type == "cpu" else reference
        return version(first, *args, **kwargs)

    return choose
