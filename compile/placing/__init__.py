"""Placing of blocks onto cores: their loads, cuts and packing, and lower bounds."""
