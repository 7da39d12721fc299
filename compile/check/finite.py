"""Refusals while a network is built: of NaN or infinity (rule SP011), and by the builder."""

from spikeport.compile.check import rules
from spikeport.compile.check.cures import cure_of
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.refusal import RefusedError, refused

NOT_FINITE = "array must not contain infs or NaNs"
"""Message of numpy.asarray_chkfinite, by which decoders' solvers check the values of functions."""


class NotFiniteError(RefusedError):
    """The error of NaN or infinite numbers, which neither passes nor the host can mend."""

    everywhere = True

    def __init__(self, violation: Violation) -> None:
        self.violations = (violation,)
        super().__init__(str(violation))


def not_finite(name: str, where: str) -> NotFiniteError:
    """Return the error for an object with NaN or infinite numbers."""
    return NotFiniteError(rules.get("SP011").broken(name, f"NaN or infinity in {where}"))


def refused_or_not_finite(about: tuple[str, ...], error: Exception) -> RefusedError:
    """Return our error for an error that nengo-loihi's builder raised at an object.

    ``about`` holds the object's name, and the names of its ends.
    """
    if str(error) == NOT_FINITE:
        return not_finite(about[0], "what its function returns")
    return refused(about, error, cure_of(error))
