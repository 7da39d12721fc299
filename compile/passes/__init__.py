"""Passes: what is done to a network, its blocks and its image on the way to the chip."""
