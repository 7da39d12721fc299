"""nengo-loihi's hardware half on our images: what it would write to a real chip, and the chip.

The order is that of the data: `half` imports nengo-loihi's hardware half, on a real NxSDK or on the
one of `recording`; `model` and `allocator` give it an image and our placement; it writes registers;
`decompile` makes an image of the registers alone, and `check` holds both side by side. `chip` is
the same path as a chip that a board can run, and `live` steps recorded registers behind
nengo-loihi's own snips.

No NxSDK was at hand: it is known here by the calls in nengo-loihi's source alone.
"""

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)
