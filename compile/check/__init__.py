"""Rules and limits that a network may break, and hints on what a compile loses."""

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)
