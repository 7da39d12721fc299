"""The errors of connections that are wired neuron to neuron, as the chip would round them.

The groups of weights into an ensemble share a scale, which its thresholds, its biases and the
largest of these weights bound. So an error depends on the target's other inputs: relays and the
host send values, whose weights are encoders times gains, far above those of single neurons.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.ensemble import Neurons
from nengo.exceptions import BuildError
from scipy.sparse.linalg import norm

from spikeport.compile.ground.filters import sends_spikes
from spikeport.compile.ground.matrices import full
from spikeport.compile.ground.names import base
from spikeport.compile.ground.scope import MATRICES, Scope, full_weights, target_rows
from spikeport.compile.loihi.relay import RELAYS
from spikeport.compile.loihi.row_scales import LEAST, RowScales
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.rewriting.decode_paths import rounding
from spikeport.compile.rewriting.links import Link, number_columns
from spikeport.neurons import OWN_TYPES


class DirectErrors:
    """The error of each link, if it is wired directly, for any set of links that are.

    Parameters
    ----------
    links : mapping of nengo.Connection to Link
        The connections that have a choice.
    scope : Scope
        The network.
    solver : ParameterSolver
        Solves the network's ensembles.
    profiles : int
        The most thresholds in one block that a following `scale_rows` scales.
    in_axons : float
        The most input axons of a core.
    """

    def __init__(
        self,
        links: Mapping[nengo.Connection, Link],
        scope: Scope,
        solver: ParameterSolver,
        profiles: int,
        in_axons: float,
    ) -> None:
        self._links, self._solver, self._dt_s = links, solver, solver.dt_s
        self._profiles, self._in_axons = profiles, in_axons
        self._largest = {c: _largest(self._weights(c)) for c in links}
        self._others = defaultdict(list)
        for c in scope.network.all_connections:
            if c not in links and scope.on_chip(c.post_obj):
                self._others[base(c.post_obj)].append(c)
        self._into = defaultdict(list)
        for c in links:
            self._into[c.post_obj].append(c)
        self._unscaled = self._unscaled_posts(scope)
        self._fixed = {post: self._of_others(post, scope) for post in self._into}
        self._axons_of_others = {
            post: sum(
                (self._axons_of_other(c, scope) for c in self._others[post]),
                np.zeros(post.n_neurons, dtype=int),
            )
            for post in self._into
        }
        self._found: dict[tuple[object, ...], RowScales | None] = {}

    def of(self, link: nengo.Connection, direct: Set[nengo.Connection], tau_s: float) -> float:
        """Return the relative rms error of a link's weights, as it is in decoded values.

        Parameters
        ----------
        link : nengo.Connection
            The link, which is wired directly.
        direct : set of nengo.Connection
            The links that are wired directly; relays send the values of the others.
        tau_s : float
            The time constant of the target's compartments, in seconds.
        """
        if isinstance(link.post_obj.neuron_type, OWN_TYPES):
            # Each group of weights into these neurons has a scale of its own.
            return rounding(self._links[link].distinct_weights)
        among = frozenset(c for c in self._into[link.post_obj] if c is link or c in direct)
        scales = self._scales(link.post_obj, among, tau_s)
        if scales is None:
            return 1.0
        units = self._units(link)
        per_unit = np.divide(1.0, units, out=np.zeros_like(units), where=units != 0)
        lost = _per_row(scales.lost(self._weights(link)), per_unit)
        return float(np.hypot(_value_error(self._links[link], lost), scales.coarseness()))

    def crowded(
        self,
        free: Sequence[nengo.Connection],
        direct: Set[nengo.Connection],
        filters: Mapping[nengo.Ensemble, float],
    ) -> Iterator[nengo.Connection]:
        """Yield links to relay so that no neuron has more direct inputs than a core has axons.

        No cut of a target mends that: all inputs of a neuron arrive on its core. The links that
        take most axons come first.

        Parameters
        ----------
        free : sequence of nengo.Connection
            The links among them that may be relayed.
        direct : set of nengo.Connection
            Every link that is wired directly.
        filters : mapping of nengo.Ensemble to float
            The time constant of each target's compartments, in seconds.
        """
        of_target = defaultdict(list)
        for c in free:
            of_target[c.post_obj].append(c)
        for post, mine in of_target.items():
            wired = [c for c in self._into[post] if c in direct]
            relays = [self._axons_of_relay(c) for c in self._into[post] if c not in direct]
            room = self._in_axons - np.sum([self._axons_of_others[post], *relays], axis=0)
            most = np.sum([_per_neuron(self._links[c].distinct_weights) for c in wired], axis=0)
            if np.all(most <= room):  # as in most networks, without a look at rounding
                continue
            axons = {c: self._axons(c, direct, filters[post]) for c in wired}
            total = np.sum([*axons.values()], axis=0)
            for c in sorted(mine, key=lambda c: -axons[c].max()):
                if np.all(total <= room):
                    break
                total = total - axons[c] + self._axons_of_relay(c)
                yield c

    def _axons_of_relay(self, link: nengo.Connection) -> np.ndarray:
        """Return the axons into each neuron, (n,), that a relay of a link takes."""
        pairs = int(RELAYS["preset10"](dt=self._dt_s).pairs_per_dim)
        return 2 * pairs * _per_neuron(self._links[link].encoders)

    def _axons_of_other(self, connection: nengo.Connection, scope: Scope) -> np.ndarray:
        """Return the axons into each neuron, (n,), that a connection takes that is no link."""
        pre, post = connection.pre_obj, base(connection.post_obj)
        from_chip = scope.on_chip(pre)
        # The host sends a value by a pair of neurons.
        per_entry = 1 if sends_spikes(connection, from_chip) else 2
        if from_chip and full_weights(connection):
            return np.full(post.n_neurons, pre.n_neurons)
        if not isinstance(connection.post_obj, Neurons):
            encoders = sparse.csr_array(self._solver.ensemble(post).encoders)
            return per_entry * _per_neuron(encoders)
        found = np.zeros(post.n_neurons, dtype=int)
        if isinstance(connection.transform, MATRICES):
            matrix = full(self._solver.transform(connection), connection.size_mid)
            np.add.at(found, target_rows(connection), np.count_nonzero(matrix, axis=1))
        return per_entry * found

    def _axons(
        self, link: nengo.Connection, direct: Set[nengo.Connection], tau_s: float
    ) -> np.ndarray:
        """Return the axons of a link into each neuron, (n,): sources of equal weights share one."""
        weights = self._links[link].distinct_weights
        among = frozenset(c for c in self._into[link.post_obj] if c in direct)
        scales = self._scales(link.post_obj, among, tau_s)
        if scales is None or isinstance(link.post_obj.neuron_type, OWN_TYPES):
            return _per_neuron(weights)
        rounded = sparse.csc_array(scales.rounded(self._weights(link)))
        rounded.eliminate_zeros()
        first = np.unique(number_columns(rounded), return_index=True)[1]
        # A piece of the target has an axon for each source of any of its neurons, so weights of
        # single neurons that are rounded to 0 save none.
        return _per_neuron(weights[:, first[np.diff(rounded.indptr)[first] > 0]])

    def _units(self, link: nengo.Connection) -> np.ndarray:
        """Return the weight, in the units of the target's compartments, of a weight of 1, (n,)."""
        units: np.ndarray = self._links[link].gains * _height(link) / self._dt_s
        return units

    def _weights(self, link: nengo.Connection) -> sparse.csr_array:
        """Return the weights (n_post, n) in the units of the target's compartments.

        .. math:: w = g E T D / dt
        """
        # Blocks have weights of 32 bits.
        weights = _per_row(self._links[link].distinct_weights, self._units(link))
        return weights.astype(np.float32)

    def _scales(
        self, post: nengo.Ensemble, direct: frozenset[nengo.Connection], tau_s: float
    ) -> RowScales | None:
        key = post, direct, tau_s
        if key not in self._found:
            rows = [self._fixed[post], *(self._largest[c] for c in direct)]
            if not direct.issuperset(self._into[post]):
                rows.append(self._encoders(post, "preset10"))
            self._found[key] = self._scaled(post, np.max(rows, axis=0), tau_s)
        return self._found[key]

    def _scaled(self, post: nengo.Ensemble, largest: np.ndarray, tau_s: float) -> RowScales | None:
        """Return the scales of an ensemble's rows; None if the chip has no such filter."""
        compartment = self._solver.compartment(post)
        compartment.tau_s = None  # nengo-loihi would not lower it
        try:
            compartment.configure_filter(tau_s, dt=self._dt_s)
        except BuildError:
            return None
        return RowScales.of(compartment, largest, 1 if post in self._unscaled else self._profiles)

    def _unscaled_posts(self, scope: Scope) -> set[nengo.Ensemble]:
        """Return the targets that `scale_rows` leaves as they are: read, or of a convolution."""
        read = (base(probe.obj) for probe in scope.network.all_probes if scope.in_chip_units(probe))
        convolved = (
            post
            for post, others in self._others.items()
            if not all(isinstance(c.transform, MATRICES) for c in others)
        )
        return {*read, *convolved}

    def _of_others(self, post: nengo.Ensemble, scope: Scope) -> np.ndarray:
        """Return the largest weights (n,) of the inputs of an ensemble that are no links."""
        largest: np.ndarray = np.max([np.zeros(post.n_neurons), *self._rows(post, scope)], axis=0)
        return largest

    def _rows(self, post: nengo.Ensemble, scope: Scope) -> Iterator[np.ndarray]:
        for c in self._others[post]:
            from_chip = scope.on_chip(c.pre_obj)
            if isinstance(c.post_obj, Neurons):
                yield self._to_neurons(c, spikes=from_chip or isinstance(c.pre_obj, Neurons))
            elif not (from_chip and full_weights(c)):
                yield self._encoders(post, "preset10" if from_chip else "onoff")

    def _encoders(self, post: nengo.Ensemble, path: str) -> np.ndarray:
        """Return the largest weights (n,) from values, which decode neurons send."""
        built = self._solver.ensemble(post)
        scale = RELAYS[path](dt=self._dt_s).scale
        largest: np.ndarray = np.abs(built.scaled_encoders).max(axis=1) * scale
        return largest

    def _to_neurons(self, connection: nengo.Connection, spikes: bool) -> np.ndarray:
        post = base(connection.post_obj)
        largest = np.zeros(post.n_neurons)
        height = _height(connection) / self._dt_s if spikes else 1.0
        weights = self._solver.transform(connection)
        if isinstance(connection.transform, MATRICES):
            matrix = full(weights, connection.size_mid)
            np.maximum.at(largest, target_rows(connection), height * np.abs(matrix).max(axis=1))
        else:  # a convolution, whose targets have equal gains
            largest[:] = height * np.abs(weights).max()
        gained: np.ndarray = largest * self._solver.ensemble(post).gain
        return gained


def _height(connection: nengo.Connection) -> float:
    """Return the factor of a source's spikes; 1 for sources that are no neurons."""
    return float(getattr(getattr(base(connection.pre_obj), "neuron_type", None), "amplitude", 1.0))


def _per_row(matrix: sparse.csr_array, factors: np.ndarray) -> sparse.csr_array:
    data = matrix.data * np.repeat(factors, np.diff(matrix.indptr))
    return sparse.csr_array((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def _value_error(link: Link, lost: sparse.csr_array) -> float:
    r"""Return the relative rms error of the decoded values, from that of weights E T D.

    .. math:: e^2 = \langle |e_k^T \Delta W|^2 / (|e_k|^2 |(T D)_k|)^2 \rangle_k

    over the dimensions k of the target, with its encoders e_k. Errors of single neurons, of either
    sign, average out as they do in the decoded value; weights that become 0 do not. Neurons
    count alike, whatever their gains, so that large ones do not hide what others lose.
    """
    decoders, encoders = norm(link.axons, axis=1), link.encoders
    wanted = norm(encoders, axis=0) ** 2 * decoders
    # Encoders of a dimension may all be 0: its values then go nowhere.
    used = (decoders > LEAST * decoders.max(initial=0)) & (wanted > 0)
    if not used.any():
        return 0.0
    errors = norm(sparse.csr_array(encoders[:, used].T @ lost), axis=1)
    return float(np.sqrt(np.mean((errors / wanted[used]) ** 2)))


def _per_neuron(weights: sparse.csr_array) -> np.ndarray:
    """Return the number of weights into each neuron, (n,)."""
    return np.diff(weights.indptr)


def _largest(weights: sparse.csr_array) -> np.ndarray:
    if not weights.nnz:
        return np.zeros(weights.shape[0])
    largest: np.ndarray = abs(weights).max(axis=1).toarray().ravel()
    return largest
