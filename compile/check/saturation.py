"""Rule SP424: neurons on the chip that would have to spike more than once in a step.

    rate(gain max(e . x / R) + bias) > 1 / dt

by the rates of their neuron type. A compartment spikes at most once in a step, so that its rate no
longer depends on the input from there on. The values x are those that decoders are solved for:
evaluation points, or all within the radius R. Neurons with gains of their own, whose values nobody
decodes, may have any input; without input, only the bias counts. Neurons whose decoders are solved
at a single point are switches, which are meant to spike in every step or not at all.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import nengo
import numpy as np
from nengo.base import NengoObject
from nengo.dists import Distribution
from nengo_loihi.neurons import LoihiLIF, LoihiSpikingRectifiedLinear

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.names import base
from spikeport.compile.ground.rewrite import Built
from spikeport.compile.ground.scope import Scope, height_in_rates, is_plain

LOST = 0.05
"""Share of spikes beyond one a step up to which their loss is not worth a hint: neurons that shall
spike in every step are driven a little harder."""
LOIHI_TYPES = (LoihiLIF, LoihiSpikingRectifiedLinear)
"""nengo-loihi's types, which spike at most once in a step in float Nengo, too."""


class Range(NamedTuple):
    """The values that decoders are solved for, in radii: bounds by dimension, and of the norm."""

    low: np.ndarray
    high: np.ndarray
    norm: float


def saturation_hints(
    scope: Scope, built: Mapping[NengoObject, Built], dt_s: float
) -> Iterator[Violation]:
    """Yield a hint on each ensemble on the chip with neurons that saturate.

    Parameters
    ----------
    scope : Scope
        The network as the user wrote it.
    built : mapping of Nengo objects to what was built for them
        The gains, biases and encoders of its ensembles.
    dt_s : float
        The time step, in seconds.
    """
    readers: dict[object, list[nengo.Connection]] = {}
    for connection in scope.network.all_connections:
        readers.setdefault(connection.pre_obj, []).append(connection)
    reached = {base(connection.post_obj) for connection in scope.network.all_connections}
    for ensemble in scope.ensembles:
        ranges = [_range(one) for one in readers.get(ensemble, [])]
        unknown = not ranges and ensemble.gain is not None and ensemble in reached
        switches = bool(ranges) and all(map(_is_point, ranges))
        # Our own types are skipped as well: they are not plain.
        kind = ensemble.neuron_type
        if unknown or switches or not is_plain(kind) or isinstance(kind, LOIHI_TYPES):
            continue
        rates_hz = _highest_hz(ensemble, built[ensemble], ranges)
        n_beyond = int((rates_hz * dt_s > 1 + LOST).sum())
        if n_beyond:
            used = f"up to {rates_hz.max():,.0f} Hz, in {n_beyond:,} of {len(rates_hz):,} neurons"
            yield rules.get("SP424").broken(scope.names[ensemble], used, f"{1 / dt_s:,.0f} Hz")


def _range(reader: nengo.Connection) -> Range:
    """Return the range of values that a connection's decoders are solved for."""
    ensemble, own = reader.pre_obj, reader.eval_points is not None
    points = reader.eval_points if own else ensemble.eval_points
    if isinstance(points, Distribution):
        return _within_radius(ensemble)
    if own and not reader.scale_eval_points:
        points = points / ensemble.radius
    return Range(points.min(axis=0), points.max(axis=0), np.linalg.norm(points, axis=1).max())


def _within_radius(ensemble: nengo.Ensemble) -> Range:
    ones = np.ones(ensemble.dimensions)
    return Range(-ones, ones, 1.0)


def _is_point(found: Range) -> bool:
    return np.array_equal(found.low, found.high)


def _highest_hz(ensemble: nengo.Ensemble, built: Built, ranges: Sequence[Range]) -> np.ndarray:
    """Return the highest rate of each neuron, by its type."""
    if not ranges and ensemble.gain is None:
        ranges = [_within_radius(ensemble)]
    drives = [_drive(built.encoders, one) for one in ranges]
    driven = np.max(drives, axis=0) if drives else np.zeros(ensemble.n_neurons)
    kind = ensemble.neuron_type
    rates: np.ndarray = kind.rates(driven[np.newaxis], built.gain, built.bias)[0]
    return rates / height_in_rates(kind)


def _drive(encoders: np.ndarray, found: Range) -> np.ndarray:
    """Return a bound of e . x / R of each neuron over a range of values."""
    by_dimension = np.maximum(encoders * found.low, encoders * found.high).sum(axis=1)
    by_norm = np.linalg.norm(encoders, axis=1) * found.norm
    bound: np.ndarray = np.minimum(by_dimension, by_norm)
    return bound
