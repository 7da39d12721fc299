"""nengo-loihi's hardware half on spikeport's images: the registers it would write, and a chip.

The modules in the order of the data: `hardware` imports nengo-loihi's hardware half, on a real
NxSDK or on the one of `recording`. `model` and `allocator` give it an image and spikeport's
placement, and it writes registers. `decompile` makes an image from the registers alone, and `check`
compares both images. `chip` is the same path as a chip that a board can run, and `live` steps
recorded registers behind nengo-loihi's own snips.

No NxSDK was at hand: it is known here only by the calls in nengo-loihi's source.
"""

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)
