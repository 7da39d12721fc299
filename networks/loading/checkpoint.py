"""Checkpoints of rsl-rl: the actor's layers, with its normalisation of observations.

    y = MLP((x - mean) / (std + eps))

A checkpoint does not say which activation its actor has.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from spikeport.arrays import Floats
from spikeport.networks.loading.chain import BoundedEvaluation, Chain, Operations, only
from spikeport.networks.loading.mlp import Mlp, Moments
from spikeport.networks.loading.refusal import SAVE
from spikeport.networks.loading.tensors import Tensor
from spikeport.networks.loading.torch_file import folder_of, pickled, pickled_in_a_row
from spikeport.reading.archive import Archive, read_bytes
from spikeport.reading.mismatch import MismatchError

EPSILON = 0.01
"""The number that rsl-rl adds to the standard deviation."""

NUMBER = "(?:0|[1-9][0-9]{0,3})"
"""The number of a layer, as torch writes it."""

PICKLE = b"\x80"
"""The first byte of a file from before torch used zip archives."""

NORMALIZER_APART = "obs_norm_state_dict"
"""The key under which rsl-rl 2 kept the normalisation."""


STATISTICS = ("running_mean", "running_var", "num_batches_tracked")
"""The ends of the keys of a batch normalisation's statistics."""

FOLD = (
    "fold a batch normalisation into the dense layer before it; layer normalisation has no dense "
    "layer that equals it: train without"
)


class CheckpointLayout(NamedTuple):
    """The place of the actor in a version of rsl-rl: names, prefixes, and patterns of names."""

    state: str
    actor: str
    normalizer: str
    deviation: str
    """The key of a Gaussian action's deviation; other distributions read the output differently."""
    others: str
    """Keys that do not affect the action."""


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


def _normalised(x: Chain, mean: Floats, std: Floats) -> Chain:
    return (x - mean) / (std + EPSILON)


OPERATIONS: Operations = {"normalisation": _normalised, "dense": Chain.dense}


def read(path: Path, activation: str) -> Mlp:
    """Return the actor of a checkpoint, with an activation."""
    content = _content(read_bytes(path))
    layout = _layout(content)
    state = _tensors(layout.state, content[layout.state])
    _refuse_others(layout, state)
    normalizer = _tensors(NORMALIZER_APART, content.get(NORMALIZER_APART, {}))
    # rsl-rl 2 kept the normalisation beside the model, later versions within it, as here.
    state |= {layout.normalizer + name: value for name, value in normalizer.items()}
    moments = _normalisation(layout, state)
    mlp = _chain(layout, state, moments, activation).mlp()
    return replace(mlp, trained_on=_moments(moments, mlp.sizes[0])) if moments else mlp


def _normalisation(layout: CheckpointLayout, state: Mapping[str, Tensor]) -> list[Tensor]:
    """Return mean and standard deviation of the observations; none without normalisation."""
    found = [name for name in state if name.startswith(layout.normalizer)]
    names = [layout.normalizer + name for name in ("_mean", "_std")]
    if found and not state.keys() >= set(names):
        held = ", ".join(name.removeprefix(layout.normalizer) for name in found)
        raise MismatchError("a normalisation with _mean and _std", held, cure=SAVE)
    return [state[name] for name in names if found]


def _chain(
    layout: CheckpointLayout,
    state: Mapping[str, Tensor],
    moments: Sequence[Tensor],
    activation: str,
) -> Chain:
    evaluation = BoundedEvaluation(OPERATIONS)

    def arrays(tensors: Iterable[Tensor]) -> list[np.ndarray]:
        found = [tensor.array() for tensor in tensors]
        for array in found:
            evaluation.keep(array)
        return found

    def applied(kind: str, chain: Chain, values: Sequence[np.ndarray]) -> Chain:
        return only([evaluation.apply(kind, chain, *values)])

    chain = applied("normalisation", Chain(), arrays(moments)) if moments else Chain()
    before = None
    for number, names in _dense(layout, state):
        layer = arrays(state[name] for name in names)
        _check_shapes(names, layer)
        # After the shapes: a normalisation, whose weight is no matrix, has a cure of its own.
        if before is not None:
            if number == before + 1:
                found = f"{layout.actor}{before} and {number}"
                raise MismatchError("an activation between two dense layers", found)
            chain = chain.activated(activation)
        chain, before = applied("dense", chain, layer), number
    return chain


def _moments(tensors: Sequence[Tensor], n_inputs: int) -> Moments:
    """Return the moments of the inputs; raise MismatchError if no inputs can have them."""
    mean, std = (np.broadcast_to(one.array().ravel().astype(float), n_inputs) for one in tensors)
    if not (np.isfinite(std).all() and (std >= 0).all()):
        raise MismatchError(
            "finite standard deviations from 0 on in the normalisation", "other values"
        )
    return Moments(mean, std)


def _content(written: bytes) -> Mapping[str, object]:
    if written.startswith(PICKLE):
        content = pickled_in_a_row(written)
    else:
        archive = Archive(written)
        content = pickled(archive, folder_of(archive, "a checkpoint of rsl-rl"), "data")
    if not isinstance(content, dict):
        raise MismatchError("a checkpoint of rsl-rl", type(content).__name__, cure=SAVE)
    return {str(name): value for name, value in content.items()}


def _layout(content: Mapping[str, object]) -> CheckpointLayout:
    for layout in LAYOUTS:
        if layout.state in content:
            return layout
    states = " or ".join(layout.state for layout in LAYOUTS)
    found = ", ".join(map(str, content))
    raise MismatchError(f"a checkpoint of rsl-rl with {states}", found, cure=SAVE)


def _tensors(name: str, state: object) -> dict[str, Tensor]:
    if not isinstance(state, dict):
        raise MismatchError(f"tensors in {name}", type(state).__name__)
    tensors = {str(key): value for key, value in state.items() if isinstance(value, Tensor)}
    if len(tensors) != len(state):
        raise MismatchError(f"tensors in {name}", "other values")
    return tensors


def _dense(
    layout: CheckpointLayout, state: Mapping[str, Tensor]
) -> Iterator[tuple[int, list[str]]]:
    """Yield every layer's number, and the names of its weights and bias, in order of numbers."""
    pattern = re.compile(rf"{re.escape(layout.actor)}({NUMBER})\.(weight|bias)")
    # Numbers have gaps: an activation counts as a layer of torch's Sequential, and has no weights.
    for number in sorted({int(m[1]) for m in map(pattern.fullmatch, state) if m}):
        names = [f"{layout.actor}{number}.{kind}" for kind in ("weight", "bias")]
        if missing := [name for name in names if name not in state]:
            raise MismatchError(missing[0], "none")
        yield number, names


def _check_shapes(names: Sequence[str], layer: Sequence[np.ndarray]) -> None:
    """Refuse a layer that is not dense by its keys: a normalisation has one weight for a unit."""
    shape, offset = (array.shape for array in layer)
    if len(shape) == 1:
        raise MismatchError(f"a matrix {names[0]} of a dense layer", f"shape {shape}", cure=FOLD)
    if offset != shape[:1]:
        raise MismatchError(f"{names[1]} of shape {shape[:1]}", f"{offset}")


def _refuse_others(layout: CheckpointLayout, state: Mapping[str, Tensor]) -> None:
    """Refuse recurrent or convolutional parts and other layers: they would be left out."""
    layers = rf"{re.escape(layout.actor)}{NUMBER}\.(weight|bias)|{re.escape(layout.normalizer)}.*"
    known = re.compile("|".join((layers, layout.deviation, layout.others)))
    for name in state:
        if not known.fullmatch(name):
            cure = FOLD if name.endswith(STATISTICS) else None
            raise MismatchError(f"an actor of dense layers, {layout.actor}N.weight", name, cure)
    if not any(re.fullmatch(layout.deviation, name) for name in state):
        raise MismatchError("a Gaussian action with one standard deviation", "another distribution")
