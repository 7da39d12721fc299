"""Rules and limits: what a network breaks, and what compiles but is lost."""

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)
