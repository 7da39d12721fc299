"""Passes over a network, its blocks and its image on the way to the chip."""

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)
