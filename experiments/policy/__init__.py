"""A policy file on the way to the chip: loading, conversion, calibration."""
