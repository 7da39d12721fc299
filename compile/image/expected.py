"""Activity expected of an image at stated firing rates, before any run.

Per step of length dt, a source (a neuron, or a spiking input) that fires at f Hz spikes f dt times.
`spikeport.compile.image.fanout` counts the costs of a spike:

    N_spk = sum_s f_s dt,   N_syn = sum_s f_s dt n_syn,s,   N_msg = sum_s f_s dt n_cores,s

Weights that learn are all updated in the last step of an epoch, whether or not anything spikes. As
the last step takes longer than the others, the steps of an epoch are counted one by one.

A compartment's update is active if it has a bias, spikes, or is the target of any source that
spikes: an upper bound, as the current of a target may have decayed to zero.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import targets_of
from spikeport.compile.image.fanout import reach
from spikeport.compile.image.host_traffic import mean_rate_hz
from spikeport.compile.image.manifest import Encoding
from spikeport.compile.image.modules import module_of_blocks
from spikeport.errors import UsageError, unknown
from spikeport.hardware_models.activity import Activity

HOST, ALL = "host", "all"
"""Names of rates of no ensemble: of the host's spikes, and of everything that is not named."""
AT_STATED_RATES = (
    "every step has the mean number of spikes, and steps of a run in which more neurons spike take "
    "longer"
)
"""The meaning of a longest step at stated rates, in words."""
MOST_STEPS = 1000
"""Steps of an epoch above which the mean of its steps is counted; nengo-loihi's have 4."""


@dataclass(frozen=True)
class Rates:
    """Mean firing rates, in Hz: ``all_hz`` of everything that ``by_name_hz`` does not name.

    Names are those of ensembles (or of connections, for the neurons that relay them), and ``host``
    for the spikes that come in from the host. If ``host`` is not named, sources that encode values
    spike at the rate of `mean_rate_hz`. Read-outs do not spike. Without ``all_hz``, neurons that
    are not named are silent, and the rates of sources that send spikes are unknown.
    """

    all_hz: float | None = None
    by_name_hz: Mapping[str, float] = field(default_factory=dict)

    @property
    def others_hz(self) -> float:
        """The rate of everything that is not named."""
        return 0.0 if self.all_hz is None else self.all_hz

    @property
    def of_host(self) -> bool:
        """True if the rates of sources that send spikes are stated."""
        return self.all_hz is not None or HOST in self.by_name_hz


def expected_activity(image: ChipImage, rates: Rates) -> Activity:
    """Return the counts expected of one step, or of the steps of an epoch if weights learn.

    Raises
    ------
    UsageError
        A rate is negative, not finite, or faster than a spike in every step, or no block has its
        name, or a block with a rate of its own is called ``host`` or ``all``.
    """
    spikes = source_rates(image, rates) * image.manifest.dt_s
    n, reached = image.n_compartments, reach(image)
    delivered = spikes[reached.source]
    on_chip = reached.source < n
    sender = image.compartment_core[reached.source[on_chip]]
    messages = np.zeros((image.n_cores, image.n_cores))
    np.add.at(messages, (sender, reached.core[on_chip]), delivered[on_chip])
    compartments = np.bincount(image.compartment_core, minlength=image.n_cores)
    active = _per_core(image, _active(image, spikes))
    step = Activity(
        cores=image.cores,
        dt_s=image.manifest.dt_s,
        spikes=_per_core(image, spikes[:n]),
        synaptic_operations=_sums(image, reached.core, delivered * reached.synaptic_operations),
        updates_active=active,
        updates_inactive=compartments - active,
        messages_in=_sums(image, reached.core, delivered),
        learning_updates=np.zeros((1, image.n_cores)),
        messages=messages,
        messages_host=_sums(image, reached.core[~on_chip], delivered[~on_chip])[0],
        host_spikes=np.array([spikes[n:].sum()]),
    )
    learned = _learning_updates(image)
    return replace(Activity.concatenate([step] * len(learned)), learning_updates=learned)


def source_rates(image: ChipImage, rates: Rates) -> np.ndarray:
    """Return the rates of compartments, then of the inputs' neurons, in Hz, (n_sources,)."""
    _check(image, rates)
    sizes = np.diff(image.blocks.start)
    named = [rates.by_name_hz.get(name, rates.others_hz) for name in module_of_blocks(image)]
    inputs = [np.full(e.size, _host_hz(e.encoding, image, rates)) for e in image.manifest.inputs]
    of_sources = np.concatenate([np.repeat(named, sizes), *inputs])
    # Read-outs hold values, and do not spike, whatever the rate of their module.
    of_sources[image.readouts] = 0
    return of_sources


def _host_hz(encoding: Encoding, image: ChipImage, rates: Rates) -> float:
    """Return the rate of the host's sources of one encoding."""
    if HOST in rates.by_name_hz:
        return rates.by_name_hz[HOST]
    if encoding.kind == "spikes":
        return rates.others_hz  # their rate is not known otherwise
    return mean_rate_hz(encoding, image.manifest.dt_s)


def _check(image: ChipImage, rates: Rates) -> None:
    modules = module_of_blocks(image)
    spikes = np.ones(image.n_compartments, dtype=bool)
    spikes[image.readouts] = False
    known = {HOST, *(modules[block] for block in np.unique(image.compartment_block[spikes]))}
    for name, meaning in ((HOST, "the spikes from the host"), (ALL, "all that is not named")):
        if name in rates.by_name_hz and name in modules:
            raise UsageError(
                f"rate of {name}: it is that of {meaning}, and an ensemble has this name, too; "
                "give the ensemble another label"
            )
    if odd := [name for name in rates.by_name_hz if name not in known]:
        raise unknown("ensemble", odd[0], known)
    fastest = 1 / image.manifest.dt_s
    for name, rate in [(ALL, rates.others_hz), *rates.by_name_hz.items()]:
        if not 0 <= rate <= fastest:
            raise UsageError(
                f"rate of {name}: {rate:g} Hz; a neuron spikes from 0 to {fastest:g} times a second"
            )


def _learning_updates(image: ChipImage) -> np.ndarray:
    """Return the weights that learning updates in each step of an epoch, (n_steps, n_cores).

    Without learning, an epoch has one step. If epochs differ, one that is common to all counts.
    """
    learns = np.flatnonzero(image.learns)
    weights, core = np.diff(image.synapse_start)[learns], image.group_core[learns]
    epoch = image.groups.learning[learns, image.manifest.learning.index("learn_epoch")].astype(int)
    n_steps = math.lcm(*epoch.tolist())
    if n_steps > MOST_STEPS:
        return _sums(image, core, weights / epoch)
    # As in a run, an epoch of 2 ends in steps 2, 4, 6, counted from 1.
    ends = np.arange(1, n_steps + 1)[:, np.newaxis] % epoch == 0
    return np.concatenate([_sums(image, core, weights * now) for now in ends])


def _per_core(image: ChipImage, of_compartments: np.ndarray) -> np.ndarray:
    return _sums(image, image.compartment_core, of_compartments)


def _sums(image: ChipImage, core: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the sum of counts on each core, (1, n_cores)."""
    return np.bincount(core, weights=counts, minlength=image.n_cores)[np.newaxis]


def _active(image: ChipImage, spikes: np.ndarray) -> np.ndarray:
    """Return the compartments whose update is active, (n_compartments,)."""
    spiking = spikes > 0
    has_bias = image.compartments.bias != 0
    result: np.ndarray = targets_of(image, spiking) | has_bias | spiking[: image.n_compartments]
    return result
