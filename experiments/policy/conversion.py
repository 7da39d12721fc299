"""A perceptron as a spiking network on a chip, compared with the exact one layer by layer.

The network is fed observations one by one, each until its values have settled. Then the values are
compared with exact ones: of every layer in float spikes, where all layers can be read, and of the
action on the chip, too.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import nengo
import numpy as np

from spikeport.compile.check.lost_values import cut_off_by_design
from spikeport.compile.passes.registry import PIPELINES
from spikeport.compile.pipeline import Compilation
from spikeport.constants import DT_S
from spikeport.experiments.calibration import play_in
from spikeport.experiments.curves import rms
from spikeport.experiments.policy.lint import ConversionLint, LayerLint
from spikeport.hardware_models.activity import Activity
from spikeport.networks.activations import activation
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.perceptron import perceptron, ranges_of
from spikeport.networks.policy import PolicyNetwork, PolicyOptions, Ranges
from spikeport.progress import Progress
from spikeport.simulator import Simulator

PASSES = PIPELINES["compact"].replace("decode_path", "decode_path{slack_cores=16}")
"""The passes for a policy: layers are wired from neuron to neuron even if relays, which carry
coarser values, would save some cores."""
HOLD_S = 0.05
"""The least time for which an observation is held: on the chip, three layers settle in 40 ms."""
SETTLED = 4
"""The least time, too, in sums of a network's time constants: less than 1 % of a step is then
missing from its action."""
SAMPLE = 20
"""The number of observations that are fed in, evenly spaced among those of the ranges."""


class Converted(NamedTuple):
    """The compiled network, the counts of its run, and the lint of the conversion."""

    compilation: Compilation
    activity: Activity
    lint: ConversionLint


class ProbedPolicy(nengo.Network):
    """A policy with an input of observations, and probes of its action and hidden layers."""

    policy: PolicyNetwork
    action: nengo.Probe
    layers: list[nengo.Probe]


@dataclass(frozen=True, eq=False)
class Conversion:
    """A conversion: a perceptron, and the options of its neurons.

    Attributes
    ----------
    mlp : Mlp
        The perceptron.
    options : PolicyOptions
        Neurons and time constants; the activation is always the perceptron's.
    observations : (m, n) array
        The observations that its units' ranges are taken from.
    seed : int
        Seed of the neurons.
    """

    mlp: Mlp
    options: PolicyOptions
    observations: np.ndarray
    seed: int = 0

    @cached_property
    def ranges(self) -> list[Ranges]:
        """Ranges of the units of every hidden layer."""
        return ranges_of(self.mlp, self.observations)

    @cached_property
    def sample(self) -> np.ndarray:
        """The observations that are fed in."""
        n = len(self.observations)
        # Spread over the recording: neighbours in time are nearly equal.
        chosen = np.linspace(0, n - 1, min(SAMPLE, n)).round().astype(int)
        return np.asarray(self.observations[chosen])

    @property
    def taus_s(self) -> tuple[float, ...]:
        """The time constant of the filter after each hidden layer."""
        n_between = len(self.ranges) - 1
        return (*[self.options.tau_fwd] * n_between, self.options.tau_out)

    @property
    def steps(self) -> int:
        """The steps for which an observation is held, until the filters have settled."""
        return round(max(HOLD_S, SETTLED * sum(self.taus_s)) / DT_S)

    def network(self, probed: bool) -> ProbedPolicy:
        """Build the spiking network; its hidden layers have probes if ``probed`` is true."""
        net = ProbedPolicy(label="conversion", seed=self.seed)
        with net:
            net.policy = perceptron(self.mlp, self.observations, self.options, self.seed)
            play_in(net.policy.observation, self.sample, self.steps, DT_S)
            net.action = nengo.Probe(net.policy.action)
            layers = zip(net.policy.layers, self.taus_s, strict=True) if probed else ()
            net.layers = [nengo.Probe(layer.output, synapse=tau) for layer, tau in layers]
        return net


def convert(conversion: Conversion, chip: str, passes: str, progress: Progress) -> Converted:
    """Compile a perceptron, and measure each layer.

    Parameters
    ----------
    conversion : Conversion
        The perceptron, its units' options and its observations.
    chip, passes : str
        As `spikeport.compile_network` takes them.
    progress : callable
        Called with what is being done and the share done.

    Raises
    ------
    DoesNotFitError, CompileError
        If the network cannot be put on the chip.
    """
    exact_action = conversion.mlp.exact(conversion.sample)[-1]
    net = conversion.network(probed=False)
    with (
        cut_off_by_design(),
        Simulator(net, chip=chip, dt=DT_S, pipeline=passes, progress=progress) as sim,
    ):
        assert sim.compilation is not None
        _run(sim, conversion, "running on the chip", progress)
        chip_error = _error(conversion, sim.data[net.action], exact_action)
        compilation, activity = sim.compilation, sim.activity
    progress("running in float", None)
    # Built anew: probes of hidden layers would be read-outs on the chip, and take cores there.
    net = conversion.network(probed=True)
    with Simulator(net, backend="reference", dt=DT_S) as sim:
        _run(sim, conversion, "running in float", progress)
        layers = tuple(_layers(conversion, net, sim))
        action_error = _error(conversion, sim.data[net.action], exact_action)
    lint = ConversionLint(layers, action_error, chip_error, sum(conversion.taus_s))
    return Converted(compilation, activity, lint)


def _run(sim: Simulator, conversion: Conversion, what: str, progress: Progress) -> None:
    n_shown = len(conversion.sample)
    for number in range(n_shown):
        progress(what, number / n_shown)
        sim.run_steps(conversion.steps)


def _error(conversion: Conversion, data: np.ndarray, wanted: np.ndarray) -> float | None:
    """Return the relative rms error at the end of every observation; None if all wanted are 0."""
    last = data[conversion.steps - 1 :: conversion.steps]
    error, size = rms(last - wanted, axis=None), rms(wanted, axis=None)
    return float(error / size) if size else None


def _layers(conversion: Conversion, net: ProbedPolicy, sim: Simulator) -> Iterator[LayerLint]:
    function = activation(conversion.mlp.activation)
    recorded, played = (
        conversion.mlp.exact(x) for x in (conversion.observations, conversion.sample)
    )
    rates_hz = dict(zip(net.all_ensembles, _rates_hz(sim.activity), strict=True))
    for number, layer in enumerate(net.policy.layers):
        radii, tau_s = conversion.ranges[number], conversion.taus_s[number]
        reach = {sign: radii.above if sign > 0 else radii.below for sign in function.signs}
        ensembles = [half.ensemble for half in layer.halves]
        n_units, n_neurons = len(radii.above), sum(e.n_neurons for e in ensembles)
        rate_hz = float(sum(rates_hz[e] for e in ensembles) / n_neurons)
        yield LayerLint(
            name=str(layer.label),
            n_units=n_units,
            below=float(np.max(reach.get(-1, 0.0))),
            above=float(reach[+1].max()),
            spread=_spread([*reach.values()], rms(recorded[number])),
            rate_hz=rate_hz,
            spikes=rate_hz * tau_s * n_neurons / n_units,
            tau_s=tau_s,
            error=_error(
                conversion, sim.data[net.layers[number]], function.function(played[number])
            ),
        )


def _spread(reach: Sequence[np.ndarray], size: np.ndarray) -> float | None:
    """Return the median range over rms pre-activation, of halves that have one other than 0."""
    alive = size > 0
    ratios = np.concatenate([one[alive] / size[alive] for one in reach])
    return float(np.median(ratios)) if len(ratios) else None


def _rates_hz(activity: Activity) -> np.ndarray:
    """Return the spikes of each ensemble in a second, on the reference backend."""
    return np.asarray(activity.over_steps("spikes") / (activity.n_steps * activity.dt_s))
