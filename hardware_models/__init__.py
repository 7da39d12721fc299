"""Chips as data, and the arithmetic of limits, energy and time on them.

In reading order: `estimate`, `figure`, `calibration` and `chip` are the data. `limits` counts
resources. `activity` holds the counts of a run; `topology`, `links` and `events` derive the counts
that cost energy or time, and `step_time`, `timing` and `energy` the costs. `host_io` is the
exchange with the host, and `computers` are ordinary computers to compare with.
"""
