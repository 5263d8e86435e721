"""The compiled encoder as a function of tensors with gradients: threads, autograd, parameters."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from forestrl.functional import FEATURES, WAYPOINTS
from forestrl.policies.gatv2.passes import ROWS, Graphs, run_chunks, unpack_gradients
from forestrl.policies.gatv2.vectors import static

_LOG = logging.getLogger(__name__)
_WIDEST = 512  # channels; with 800 compiling takes minutes, and numba ends at 1000
_CHUNKS = 8  # of a batch; gradients are summed within and then over them
_PER_THREAD = 32  # graphs that are worth starting a thread for


@cache
def compiles(channels: int) -> bool:
    """Tells whether layer 1 is narrow enough to be compiled, and says once if it is not."""
    if channels <= _WIDEST:
        return True
    _LOG.warning(
        "heads x hidden = %d is more than is compiled, %d: PyTorch Geometric computes it, slower",
        channels,
        _WIDEST,
    )
    return False


@cache
def _shapes(heads: int, hidden: int) -> tuple:
    """Channels, heads and channels per head of both layers, as compile-time constants."""
    return static(heads * hidden, heads, hidden), static(1, 1, 1)


def _launch(
    graphs: Sequence[Tensor], parameters: Sequence[Tensor], constants: tuple[float, float, float],
    logits: Tensor, gradients: Sequence[Tensor] = (),
) -> None:  # fmt: skip
    """Writes the logits; or reads their gradients and writes those of the parameters."""
    arrays = tuple([p.detach().numpy() for p in parameters])
    _, heads, hidden = arrays[5].shape
    rows = (max(1, min(_CHUNKS, len(logits))), ROWS if gradients else 0)
    d = np.zeros((*rows, heads * hidden), arrays[0].dtype)
    d2 = np.zeros((*rows, 1), arrays[0].dtype)
    shared: tuple[Any, ...] = (
        Graphs(*[g.numpy() for g in graphs]), arrays, constants, _shapes(heads, hidden),
        logits.numpy(), d, d2,
    )  # fmt: skip
    parts = max(1, min(torch.get_num_threads(), len(d), len(logits) // _PER_THREAD))
    if parts == 1:
        valid = run_chunks(0, 1, *shared)
    else:
        with ThreadPoolExecutor(parts - 1) as pool:
            others = [pool.submit(run_chunks, part, parts, *shared) for part in range(1, parts)]
            valid = run_chunks(0, parts, *shared) and all([other.result() for other in others])
    if not valid:
        msg = f"the waypoint of a frontier must be in 1 to {WAYPOINTS - 1}"
        raise ValueError(msg)
    if gradients:
        unpack_gradients(d, d2, tuple([g.numpy() for g in gradients]))


class _Encode(torch.autograd.Function):
    """The encoder as one node of the autograd graph."""

    @staticmethod
    def forward(constants: tuple[float, float, float], *tensors: Tensor) -> Tensor:
        logits = tensors[0].new_empty(len(tensors[0]), WAYPOINTS)
        _launch(tensors[:4], tensors[4:], constants, logits)
        return logits

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        constants, *tensors = inputs
        ctx.constants = constants
        ctx.save_for_backward(*tensors)

    @staticmethod
    def vmap(
        info: Any, in_dims: tuple[int | None, ...], constants: tuple[float, float, float],
        *tensors: Tensor,
    ) -> tuple[Tensor, int]:  # fmt: skip
        """Takes one more batch dimension of the graphs for more graphs of the batch."""
        dims = in_dims[1:]
        if any(dim is not None for dim in dims[4:]):
            msg = "the fused GATv2 kernel cannot vmap over its parameters: use model.kernel=pyg"
            raise NotImplementedError(msg)
        rows = [
            tensor.expand(info.batch_size, *tensor.shape) if dim is None else tensor.movedim(dim, 0)
            for tensor, dim in zip(tensors[:4], dims[:4], strict=True)
        ]
        graphs = [each.flatten(0, 1).contiguous() for each in rows]
        logits = _Encode.apply(constants, *graphs, *tensors[4:])
        return logits.unflatten(0, (info.batch_size, -1)), 0

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, d_logits: Tensor) -> tuple[Tensor | None, ...]:
        tensors = ctx.saved_tensors
        gradients = [torch.empty_like(p) for p in tensors[4:]]
        _launch(tensors[:4], tensors[4:], ctx.constants, d_logits.contiguous(), gradients)
        return (None,) * 5 + tuple(gradients)


def encode(
    x: Tensor, waypoint: Tensor, length: Tensor, frontiers: Tensor, parameters: Sequence[Tensor],
    *, slopes: tuple[float, float], lidar_range: float,
) -> Tensor:  # fmt: skip
    """Computes the logits of the encoder from plain tensors on the CPU.

    Args:
        x: node features, float32 or float64 ``[*B, 9 + M, 8]``; there is no gradient for it.
        waypoint: the waypoint each frontier is tied to, 1 to 8, int64 ``[*B, M]``.
        length: the length of that edge in units of ``l``, ``[*B, M]``.
        frontiers: the number of frontiers, int64 ``[*B, 1]``; the first ``M`` count.
        parameters: of layer 1, then of layer 2: ``lin_l.weight``, ``lin_l.bias``,
            ``lin_r.weight``, ``lin_r.bias``, ``lin_edge.weight``, ``att``, ``bias``.
        slopes: the negative slopes of the two layers' LeakyReLU.
        lidar_range: ``l``, cells.

    Returns:
        the outputs of nodes 0 to 8, ``[*B, 9]``.
    """
    if x.requires_grad or length.requires_grad:
        msg = "the fused GATv2 kernel has no gradient for x and length: detach them or use 'pyg'"
        raise ValueError(msg)
    if x.dtype != parameters[0].dtype:
        msg = f"x is {x.dtype} but the parameters are {parameters[0].dtype}"
        raise TypeError(msg)
    batch, nodes, room = x.shape[:-2], x.shape[-2], waypoint.shape[-1]
    if x.shape[-1] != FEATURES or nodes != WAYPOINTS + room:
        msg = f"x must be [*B, {WAYPOINTS} + {room}, {FEATURES}], not {list(x.shape)}"
        raise ValueError(msg)
    x = x.reshape(-1, nodes, FEATURES).contiguous()
    graphs = (
        x,
        waypoint.reshape(len(x), room).contiguous(),
        length.reshape(len(x), room).to(x.dtype).contiguous(),
        frontiers.reshape(len(x)).contiguous(),
    )
    parameters = [p.contiguous() for p in parameters]
    constants = (*slopes, 1.0 / lidar_range)
    return _Encode.apply(constants, *graphs, *parameters).view(*batch, WAYPOINTS)


def gatv2_encoder(
    x: Tensor, waypoint: Tensor, length: Tensor, frontiers: Tensor, conv1: nn.Module,
    conv2: nn.Module, *, lidar_range: float = 5.0,
) -> Tensor:  # fmt: skip
    """Computes the logits, :func:`encode`, with the parameters of two ``GATv2Conv`` modules.

    Args:
        x: see :func:`encode`, as the others.
        waypoint: int64 ``[*B, M]``.
        length: ``[*B, M]``.
        frontiers: int64 ``[*B, 1]``.
        conv1: ``GATv2Conv(8, hidden, heads=heads, edge_dim=1)``, concatenating.
        conv2: ``GATv2Conv(heads * hidden, 1, edge_dim=1)``.
        lidar_range: ``l``, cells.

    Returns:
        the outputs of nodes 0 to 8, ``[*B, 9]``.
    """
    parameters: list[Any] = []
    convs: tuple[Any, ...] = (conv1, conv2)
    for conv in convs:
        left, right, edge = conv.lin_l, conv.lin_r, conv.lin_edge
        parameters += [left.weight, left.bias, right.weight, right.bias, edge.weight]
        parameters += [conv.att, conv.bias]
    slopes: Any = (conv1.negative_slope, conv2.negative_slope)
    return encode(
        x, waypoint, length, frontiers, parameters, slopes=slopes, lidar_range=lidar_range
    )
