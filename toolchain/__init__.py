"""spikeport: Nengo networks on Loihi-style neuromorphic chips, in closed loop with a robot."""

__version__ = "0.1.0"
