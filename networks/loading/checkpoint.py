"""Checkpoints of rsl-rl: the actor's layers, with its normalisation of observations.

    y = MLP((x - mean) / (std + eps))

A checkpoint does not say which activation its actor has.
"""

import pickle
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from spikeport.networks.loading.chain import Chain
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.loading.refusal import MismatchError, extra

if TYPE_CHECKING:
    import torch

EPSILON = 0.01
"""rsl-rl's, added to the standard deviation."""

NORMALIZER_APART = "obs_norm_state_dict"
"""Where rsl-rl 2 kept the normalisation."""


class CheckpointLayout(NamedTuple):
    """Where versions of rsl-rl keep their actor: names, prefixes, and patterns of names."""

    state: str
    actor: str
    normalizer: str
    deviation: str
    """Of a Gaussian action; another distribution makes something else of the actor's output."""
    others: str
    """What does not bear on the action."""


LAYOUTS = (
    CheckpointLayout(
        "actor_state_dict", "mlp.", "obs_normalizer.", r"distribution\.(log_)?std_param", ""
    ),
    CheckpointLayout(
        "model_state_dict",
        "actor.",
        "actor_obs_normalizer.",
        "(log_)?std",
        r"critic\..*|critic_obs_normalizer\..*",
    ),
)


def read(path: Path, activation: str) -> Mlp:
    """The actor of a checkpoint, with this activation."""
    content = _content(path)
    layout = _layout(content)
    state = _arrays(layout.state, content[layout.state])
    _refuse_others(layout, state)
    apart = _arrays(NORMALIZER_APART, content.get(NORMALIZER_APART, {}))
    state |= {layout.normalizer + name: value for name, value in apart.items()}
    chain = _normalised(layout, state)
    for number, (weights, bias) in enumerate(_dense(layout, state)):
        chain = (chain.activated(activation) if number else chain).dense(weights, bias)
    return chain.mlp()


def _content(path: Path) -> Mapping[str, Any]:
    torch = extra("torch")
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError:
        found = "other objects, which may run code"
        raise MismatchError("tensors and plain values", found) from None
    except (RuntimeError, EOFError) as error:
        raise MismatchError("a checkpoint of rsl-rl", str(error).splitlines()[0]) from error
    if not isinstance(content, Mapping):
        raise MismatchError("a checkpoint of rsl-rl", type(content).__name__)
    return content


def _layout(content: Mapping[str, object]) -> CheckpointLayout:
    for layout in LAYOUTS:
        if layout.state in content:
            return layout
    states = " or ".join(layout.state for layout in LAYOUTS)
    raise MismatchError(f"a checkpoint of rsl-rl with {states}", ", ".join(map(str, content)))


def _arrays(name: str, state: Mapping[str, "torch.Tensor"]) -> dict[str, np.ndarray]:
    try:
        return {key: value.double().numpy() for key, value in state.items()}
    except AttributeError:
        raise MismatchError(f"tensors in {name}", "other values") from None


def _dense(layout: CheckpointLayout, state: Mapping[str, np.ndarray]) -> Iterator[list[np.ndarray]]:
    """Weights and bias of every layer, in the order of their numbers."""
    pattern = re.compile(rf"{re.escape(layout.actor)}(\d+)\.(weight|bias)")
    for number in sorted({int(m[1]) for m in map(pattern.fullmatch, state) if m}):
        names = [f"{layout.actor}{number}.{kind}" for kind in ("weight", "bias")]
        if missing := [name for name in names if name not in state]:
            raise MismatchError(missing[0], "none")
        yield [state[name] for name in names]


def _refuse_others(layout: CheckpointLayout, state: Mapping[str, np.ndarray]) -> None:
    """Recurrent or convolutional parts, or layers of another kind, would be left out."""
    layers = rf"{re.escape(layout.actor)}\d+\.(weight|bias)|{re.escape(layout.normalizer)}.*"
    known = re.compile("|".join((layers, layout.deviation, layout.others)))
    for name in state:
        if not known.fullmatch(name):
            raise MismatchError(f"an actor of dense layers, {layout.actor}N.weight", name)
    if not any(re.fullmatch(layout.deviation, name) for name in state):
        raise MismatchError("a Gaussian action with one standard deviation", "another")


def _normalised(layout: CheckpointLayout, state: Mapping[str, np.ndarray]) -> Chain:
    mean, std = (state.get(f"{layout.normalizer}{name}") for name in ("_mean", "_std"))
    if mean is None or std is None:
        return Chain()
    return (Chain() - mean) / (std + EPSILON)
