"""nengo_spa's basal ganglia and thalamus, as they are: LIF neurons, AMPA with 2 ms, GABA with 8 ms.

This network is for float Nengo, which filters every connection by itself. A compartment on the chip
has one filter for all its inputs, so it cannot represent GPi and GPe, whose excitation has 2 ms and
inhibition 8 ms. `action_selection` replaces this network there, and is measured against it.

Source: Stewart, Choo, Eliasmith (2010); paper, sec. 3.3.
"""

import nengo
import numpy as np
from nengo.base import ObjView
from nengo.networks import EnsembleArray
from nengo_spa.modules.basalganglia import BasalGanglia
from nengo_spa.modules.thalamus import Thalamus

from spikeport.networks.action_selection import SelectionNetwork, SelectionOptions, gate_neurons

NUCLEI = ("strD1", "strD2", "stn", "gpe", "gpi")


def spa_action_selection(n_actions: int, seed: int = 0) -> SelectionNetwork:
    """Build the network; ``gates`` are its thalamus' filtered outputs.

    The thalamus inhibits the gates' neurons, which are those of `action_selection`.
    """
    net = SelectionNetwork(label="action selection of nengo_spa", seed=seed)
    options = SelectionOptions()
    with net:
        ganglia = BasalGanglia(n_actions, label="ganglia")
        thalamus = Thalamus(n_actions, label="thalamus")
        thalamus.connect_bg(ganglia)
        net.utilities = ganglia.input
        net.gates = nengo.Node(size_in=n_actions, label="gates")
        # The thalamus' output is decoded spikes: unfiltered, it would cross a threshold at each.
        nengo.Connection(thalamus.output, net.gates, synapse=options.output_s)
        net.nuclei = {name: _neurons(getattr(ganglia, name)) for name in NUCLEI}
        net.nuclei["thalamus"] = _neurons(thalamus.actions)
        gates, net.nuclei["gate"] = gate_neurons(n_actions, options, seed)
        nengo.Connection(
            thalamus.output, gates, transform=-np.eye(n_actions), synapse=options.gate_s
        )
    return net


def _neurons(array: EnsembleArray) -> list[ObjView]:
    """Return the spikes of each action's population, as parts of one node."""
    spikes, size = array.add_neuron_output(), array.n_neurons_per_ensemble
    return [spikes[i * size : (i + 1) * size] for i in range(array.n_ensembles)]
