"""Rewritten networks: equal in float, but of another structure, for nengo-loihi to build."""

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)
