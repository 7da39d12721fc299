"""Chips as data, and the arithmetic of limits, energy and time on them.

In reading order: `estimate`, `figure`, `calibration`, `chip` (and `chip_file`, which reads one);
`limits` counts resources; `activity` holds the counts of a run, `topology` and `events` say what
of them costs, `step_time`, `timing` and `energy` how much.
"""
