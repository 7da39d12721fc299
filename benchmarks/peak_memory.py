"""The most memory that a process has had; imports nothing that would take some itself."""

import resource


def peak_bytes() -> float:
    """Return the most memory that this process has had."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
