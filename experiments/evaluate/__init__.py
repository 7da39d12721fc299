"""Robustness of a walking policy: random commands under perturbations."""
