"""Runs of anybody's network."""
