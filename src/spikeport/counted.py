"""Counts of things, in words."""


def counted(n: float, noun: str) -> str:
    """Return a number with its noun, such as "1 core" or "2,306 synapses"."""
    return f"{n:,} {noun}{'s' * (n != 1)}"
