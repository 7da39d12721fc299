"""The ground the rooms of compile stand on: names, settings and refusals of a network.

Importing it imports nengo-loihi in silence; modules that use nengo-loihi import this room first.
"""

import warnings

import nengo  # noqa: F401 (before the block, at whose end filters it had set would be lost)
import scipy.special  # noqa: F401 (likewise)

with warnings.catch_warnings():
    # It warns of every nengo newer than 3.2; spikeport.compile.loihi.numpy1 handles what differs.
    warnings.filterwarnings("ignore", message="This version of `nengo_loihi`")
    import nengo_loihi  # noqa: F401
