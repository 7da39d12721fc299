"""nengo_spa's basal ganglia and thalamus, as they are: what `action_selection` is measured against.

Populations of LIF neurons, AMPA with 2 ms and GABA with 8 ms: for float Nengo, which filters every
connection by itself.
"""

from nengo_spa.modules.basalganglia import BasalGanglia
from nengo_spa.modules.thalamus import Thalamus

from spikeport.networks.action_selection import SelectionNetwork

NUCLEI = ("strD1", "strD2", "stn", "gpe", "gpi")


def spa_action_selection(n_actions: int, seed: int = 0) -> SelectionNetwork:
    """Build the network; ``gates`` are the outputs of its thalamus."""
    net = SelectionNetwork(label="action selection of nengo_spa", seed=seed)
    with net:
        ganglia = BasalGanglia(n_actions, label="ganglia")
        thalamus = Thalamus(n_actions, label="thalamus")
        thalamus.connect_bg(ganglia)
        net.utilities, net.gates = ganglia.input, thalamus.output
        populations = {name: getattr(ganglia, name) for name in NUCLEI}
        populations["thalamus"] = thalamus.actions
        net.nuclei = {
            name: [ensemble.neurons for ensemble in array.ensembles]
            for name, array in populations.items()
        }
    return net
