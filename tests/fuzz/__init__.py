"""Good files with bytes changed: each of them loads, or is refused in spikeport's own words."""
