"""Chips as data, and the arithmetic of limits, energy and time on them.

In reading order: `estimate`, `figure`, `calibration` and `chip` are the data. `limits` counts
resources. `activity` holds the counts of a run; `topology` and `events` derive the counts that cost
energy or time, and `step_time`, `timing` and `energy` the costs.
"""
