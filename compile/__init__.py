"""From a Nengo network to a chip image."""

import warnings

# It warns of every nengo newer than 3.2; what differs is handled in spikeport.compile.loihi.numpy1.
warnings.filterwarnings("ignore", message="This version of `nengo_loihi`")
