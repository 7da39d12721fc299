"""Inhibition that silences a random share of a network's ensembles from a moment on.

Neurons that nothing excites before that moment, and that fire in every step after it, close a gate
(`spikeport.networks.gating`) on the ensembles that were drawn.

Source: paper, sec. 4.2 and Fig. 5c.
"""

import nengo
import numpy as np

from spikeport.networks.gating import full_rate_ensemble, gate


def silence(
    net: nengo.Network, share: float, at_s: float, synapse: float, seed: int
) -> list[nengo.Ensemble]:
    """Silence a share of a network's ensembles, drawn from a seed, at a time in seconds.

    ``synapse`` is the filter of the inhibition, which equals that of the ensembles' other inputs.
    Return the ensembles that fall silent, in the network's order: at least one if share > 0.
    """
    ensembles = list(net.all_ensembles)
    n = max(round(share * len(ensembles)), int(share > 0))
    drawn = np.random.RandomState(seed).permutation(len(ensembles))[:n]
    chosen = [ensembles[i] for i in sorted(drawn)]
    with net:
        onset = nengo.Node(lambda t: float(t > at_s), label="onset of silence")
        inhibitor = full_rate_ensemble("silence")
        nengo.Connection(onset, inhibitor, synapse=None)
        gate(inhibitor.neurons, chosen, synapse=synapse)
    return chosen
