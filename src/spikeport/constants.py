"""Numbers that every part of spikeport agrees on."""

DT_S = 0.001
"""Default time step of a simulation, in s, as in nengo-loihi and the paper."""

LONGEST_RUN = 10**9
"""Steps of the longest run: with steps of 1 ms and in real time it takes eleven days."""

MOST_POINTS = 100_000
"""Most points of a sweep: each is a run, and a file in one folder."""

LARGEST_SEED = 2**32 - 1
"""The largest seed of NumPy's random states."""

DECAY_UNITS = 4096
"""A chip's decays of currents and voltages are multiples of 1 / 4096."""

BITS_PER_BYTE = 8

BITS_PER_KIB = BITS_PER_BYTE * 1024
"""Bits of a KiB: memories of chips are counted in bits, and shown in KiB."""
