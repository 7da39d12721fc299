"""The peak memory of a process; this module imports nothing that takes memory itself."""

import resource


def peak_bytes() -> float:
    """Return the peak memory of this process."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
