"""Runs of users' networks."""
