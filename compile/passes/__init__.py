"""Passes over a network, its blocks and its image on the way to the chip."""
