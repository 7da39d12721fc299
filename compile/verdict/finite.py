"""Numbers that are not finite and show only while a network is built: rule SP011."""

from spikeport.compile.refusal import RefusedError, refused
from spikeport.compile.verdict import rules

NOT_FINITE = "array must not contain infs or NaNs"
"""What numpy.asarray_chkfinite says, by which decoders' solvers check what functions return."""
CURE = "change this object"


def not_finite(name: str, where: str) -> RefusedError:
    """The error for an object of which some numbers are NaN or infinite."""
    return RefusedError(str(rules.get("SP011").broken(name, f"NaN or infinity in {where}")))


def refused_or_not_finite(name: str, error: Exception) -> RefusedError:
    """The error for what nengo-loihi's builder raised at an object."""
    if str(error) == NOT_FINITE:
        return not_finite(name, "what its function returns")
    return refused(name, error, CURE)
