"""Chips as data, and the arithmetic of limits, energy and time on them."""
