"""Chips as data, and the arithmetic of limits, energy and time on them.

In reading order: `estimate`, `figure`, `calibration`, `chip`;
`limits` counts resources; `activity` holds the counts of a run, `topology` and `events` say what
of them costs, `step_time`, `timing` and `energy` how much.
"""
