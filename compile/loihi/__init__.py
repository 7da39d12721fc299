"""Building and discretising by nengo-loihi: the only package that calls its builder."""

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)
