"""Networks rewritten: equal in float, other in shape, before nengo-loihi builds them."""

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)
