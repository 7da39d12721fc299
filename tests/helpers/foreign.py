"""Policies of others, and parts of files that no library would write."""

import zipfile
from collections.abc import Callable
from pathlib import Path

import torch
from torch import Tensor, nn

from spikeport.networks.loading import isaac
from spikeport.networks.loading.refusal import refusing


class Policy(nn.Module):
    """A policy with a method that writes, which nobody calls."""

    def __init__(self) -> None:
        super().__init__()
        torch.manual_seed(0)
        self.net = nn.Sequential(nn.Linear(5, 4), nn.ELU(), nn.Linear(4, 3))

    def forward(self, x: Tensor) -> Tensor:
        return self.net(x)

    @torch.jit.export
    def reset(self, x: Tensor) -> None:
        torch.save(x, "harm")


def members(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as read:
        return {name: read.read(name) for name in read.namelist()}


def pack(path: Path, content: dict[str, bytes]) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as written:
        for name, value in content.items():
            written.writestr(name, value)


class Reduced:
    def __init__(self, function: Callable[..., object], *arguments: object) -> None:
        self.called = (function, arguments)

    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        return self.called


def by_instructions(*made: bytes) -> bytes:
    return b"\x80\x02" + b"".join(made) + b"."


def state(**others: object) -> dict[str, object]:
    tensors = {"mlp.0.weight": torch.ones(4, 5), "mlp.0.bias": torch.ones(4)}
    tensors |= {"mlp.2.weight": torch.ones(3, 4), "mlp.2.bias": torch.ones(3)}
    return {**tensors, "distribution.std_param": torch.ones(3), **others}


def described(path: Path) -> None:
    """Read a description, and refuse its file as a policy is refused."""
    with refusing(path):
        isaac.described(path)
