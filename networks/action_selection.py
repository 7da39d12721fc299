"""Selection of one of n actions by spiking basal ganglia and thalamus, for the chip.

    strD1_i    = [ws (1 + lg) u_i - e]+
    strD2_i    = [ws (1 - le) u_i - e]+
    stn_i      = mp [wt u_i - wg gpe_i - ep]+
    gpe_i      = me [wp sum_j stn_j - wm strD2_i - ee]+
    gpi_i      = mg [wp sum_j stn_j - wm strD1_i - we gpe_i - eg]+
    thalamus_i = [1 + w_out gpi_i - m sum_{j != i} thalamus_j]+ / 0.6
    gate_i     = [0.3 - thalamus_i]+ / 0.3

The gates of all actions but the selected one fire, and silence the populations they are wired to
(`spikeport.networks.gating`): the selected action is disinhibited. Weights are those of nengo_spa's
basal ganglia, u the utilities times a gain. Differences from nengo_spa make the selection sharp in
the noise of few neurons. Its LIF populations are replaced by spiking rectified linear neurons with
one decoder per population (`solvers.Tied`), which compute [.]+ directly and share axons on the
chip. The thalamus has no threshold and saturates its gate. A population on the chip has one filter,
where nengo_spa filters GABA with 8 ms and AMPA with 2 ms.

Source: Gurney, Prescott, Redgrave (2001), Biological Cybernetics 84, 401-423; Stewart, Choo,
Eliasmith (2010); paper, sec. 3.3.
"""

from dataclasses import dataclass

import nengo
import numpy as np
from nengo.base import ObjView
from nengo_spa.modules.basalganglia import BasalGanglia, Weights

from spikeport.errors import UsageError
from spikeport.networks.rectified import Rectified
from spikeport.node_functions import Affine

GATE_RATES = (1500.0, 1800.0)
"""Rates of a closed gate's neurons, in Hz. They exceed the chip's one spike a step, so that the
gate fires in every step even before it is fully closed."""


@dataclass(frozen=True)
class SelectionOptions:
    """Sizes, weights that differ from nengo_spa's, rates in Hz, and time constants in seconds.

    A population (one nucleus, one action) has ``n_neurons``, a gate has ``gate_neurons``.
    """

    n_neurons: int = 20
    gate_neurons: int = 8
    max_rates: tuple[float, float] = (200.0, 400.0)
    utility_gain: float = 1.4
    mutual_inhibition: float = 0.6
    ampa_s: float = 0.005
    gaba_s: float = 0.005
    thalamus_s: float = 0.003
    gate_s: float = 0.002
    output_s: float = 0.005


class SelectionNetwork(nengo.Network):
    """Network that selects an action.

    ``utilities`` (n) is its input; ``gates`` (n) is 1 for the selected action and 0 for the others.
    ``nuclei`` holds the neurons of each nucleus, action by action, for probes and connections.
    """

    utilities: nengo.Node
    gates: nengo.Node
    nuclei: dict[str, list[ObjView]]


def action_selection(
    n_actions: int, options: SelectionOptions | None = None, seed: int = 0
) -> SelectionNetwork:
    """Build the network.

    Parameters
    ----------
    n_actions : int
        Number of actions.
    options : SelectionOptions, optional
        Sizes, weights, rates and time constants.
    seed : int
        Seed of the neurons' rates.

    Raises
    ------
    UsageError
        If there is nothing to select from.
    """
    if n_actions < 2:
        raise UsageError(f"n_actions={n_actions}: there must be at least 2 to select from")
    net = SelectionNetwork(label="action selection", seed=seed)
    with net:
        build = _Builder(net, n_actions, options or SelectionOptions(), seed)
        build.inputs()
        build.basal_ganglia()
        build.thalamus()
    return net


def _kinds(options: SelectionOptions) -> dict[str, Rectified]:
    """Return the populations of each nucleus, for utilities up to 1."""
    size, rates, w = options.n_neurons, options.max_rates, Weights
    inputs = _input_weights(options)
    return {
        "strD1": Rectified(w.e, w.mm, inputs["strD1"], size, rates),
        "strD2": Rectified(w.e, w.mm, inputs["strD2"], size, rates),
        "stn": Rectified(w.ep, w.mp, 1.0, size, rates),
        "gpe": Rectified(w.ee, w.me, 1.0, size, rates),
        "gpi": Rectified(w.eg, w.mg, 0.1, size, rates),
        "thalamus": Rectified(-1.0, 1 / 0.6, -0.3, size, rates),
        "gate": _gate(options),
    }


def _gate(options: SelectionOptions) -> Rectified:
    return Rectified(-0.3, 1 / 0.3, 0.0, options.gate_neurons, GATE_RATES, switches=True)


def gate_neurons(
    n_actions: int, options: SelectionOptions, seed: int
) -> tuple[nengo.Ensemble, list[ObjView]]:
    """Make the gates' neurons: an action's fire while its input, a negative value, is above -0.3.

    Returns
    -------
    gates : nengo.Ensemble
        The ensemble of all gates, which takes a value for each action.
    neurons : list of ObjView
        The neurons of each action, which silence the populations they are wired to.
    """
    kind = _gate(options)
    gates = kind.ensemble(n_actions, 1.0, np.random.RandomState(seed), "gate")
    return gates, _by_action(gates, kind, n_actions)


def _by_action(ensemble: nengo.Ensemble, kind: Rectified, n_actions: int) -> list[ObjView]:
    neurons, size = ensemble.neurons, kind.n_neurons
    return [neurons[i * size : (i + 1) * size] for i in range(n_actions)]


def _input_weights(options: SelectionOptions) -> dict[str, float]:
    weights = {
        "strD1": Weights.ws * (1 + Weights.lg),
        "strD2": Weights.ws * (1 - Weights.le),
        "stn": Weights.wt,
    }
    return {name: options.utility_gain * weight for name, weight in weights.items()}


class _Builder:
    """Builder of the parts of a `SelectionNetwork`."""

    def __init__(
        self, net: SelectionNetwork, n_actions: int, options: SelectionOptions, seed: int
    ) -> None:
        self.net = net
        self.n_actions = n_actions
        self.options = options
        self.own = np.eye(n_actions)
        self.every = np.ones((n_actions, n_actions))
        self.kinds = _kinds(options)
        self.weights = _input_weights(options)
        rng, radius = np.random.RandomState(seed), max(self.weights.values())
        self.ensembles = {
            name: kind.ensemble(n_actions, radius, rng, name) for name, kind in self.kinds.items()
        }
        net.nuclei = {
            name: _by_action(self.ensembles[name], kind, n_actions)
            for name, kind in self.kinds.items()
        }

    def inputs(self) -> None:
        """Spread the utilities to the input stage."""
        self.net.utilities = nengo.Node(size_in=self.n_actions, label="utilities")
        for name, weight in self.weights.items():
            nengo.Connection(
                self.net.utilities, self.ensembles[name], transform=weight, synapse=None
            )

    def basal_ganglia(self) -> None:
        """Inhibit action by action, and excite all from the subthalamic nucleus."""
        gaba, ampa = self.options.gaba_s, self.options.ampa_s
        self._connect("strD1", "gpi", -Weights.wm * self.own, gaba)
        self._connect("strD2", "gpe", -Weights.wm * self.own, gaba)
        self._connect("gpe", "gpi", -Weights.we * self.own, gaba)
        self._connect("gpe", "stn", -Weights.wg * self.own, gaba)
        # From all to all: the higher the others' utilities, the more an action needs to win.
        for pallidum in ("gpi", "gpe"):
            self._connect("stn", pallidum, Weights.wp * self.every, ampa)

    def thalamus(self) -> None:
        """Let the actions compete, and close the gates of those that lose."""
        options = self.options
        output = BasalGanglia.output_weight.default * self.own
        lateral = options.mutual_inhibition * (self.own - self.every)
        self._connect("gpi", "thalamus", output, options.thalamus_s)
        self._connect("thalamus", "thalamus", lateral, options.thalamus_s)
        self._connect("thalamus", "gate", -self.own, options.gate_s)
        # Gates fire for the actions that lose; the output is 1 for the one that wins.
        self.net.gates = nengo.Node(Affine(-1, 1), size_in=self.n_actions, label="gates")
        self._connect("gate", self.net.gates, self.own, options.output_s)

    def _connect(
        self, pre: str, post: str | nengo.Node, transform: np.ndarray, synapse: float
    ) -> None:
        """Connect to neurons by weights, or to a node by decoders."""
        wired = isinstance(post, str)
        nengo.Connection(
            self.ensembles[pre],
            self.ensembles[post] if wired else post,
            transform=transform,
            synapse=synapse,
            **self.kinds[pre].decoding(self.n_actions, weights=wired),
        )
