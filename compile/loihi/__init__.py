"""Building and discretising by nengo-loihi: the only room that calls its builder."""

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)
