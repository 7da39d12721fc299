"""Numbers that are not finite and show only while a network is built: rule SP011."""

from spikeport.compile.check import rules
from spikeport.compile.ground.refusal import RefusedError, refused

NOT_FINITE = "array must not contain infs or NaNs"
"""Message of numpy.asarray_chkfinite, by which decoders' solvers check the values of functions."""
CURE = "change this object"


def not_finite(name: str, where: str) -> RefusedError:
    """Return the error for an object of which some numbers are NaN or infinite."""
    return RefusedError(str(rules.get("SP011").broken(name, f"NaN or infinity in {where}")))


def refused_or_not_finite(name: str, error: Exception) -> RefusedError:
    """Return the error for what nengo-loihi's builder raised at an object."""
    if str(error) == NOT_FINITE:
        return not_finite(name, "what its function returns")
    return refused(name, error, CURE)
