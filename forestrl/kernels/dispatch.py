"""The one place that decides between a compiled function and its reference in torch."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from numba.core.errors import NumbaError
from torch import Tensor

R = TypeVar("R")


def by_device(compiled: Callable[..., R], reference: Callable[..., R]) -> Callable[..., R]:
    """Takes the compiled version for CPU tensors and the reference for all others.

    Where numba refuses to compile, as another of its versions may, one line says so and the
    reference takes over.

    Args:
        compiled: for the CPU.
        reference: of the same signature, for every device.

    Returns:
        a function of that signature, which looks at its first argument, a tensor.
    """
    refused: list[str] = []

    @wraps(reference)
    def choose(first: Tensor, *args: object, **kwargs: object) -> R:
        if first.device.type == "cpu" and not refused:
            try:
                return compiled(first, *args, **kwargs)
            except NumbaError as error:  # raised while compiling, never by the compiled code
                refused.append(str(error))
                name = reference.__name__.strip("_")
                message = f"numba does not compile {name} here, torch takes over: {error}"
                warnings.warn(" ".join(message.split())[:300], RuntimeWarning, stacklevel=2)
        return reference(first, *args, **kwargs)

    return choose
