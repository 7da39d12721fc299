"""``--rate-hz 100 --rate-hz NAME=50``: firing rates stated on the command line."""

from spikeport.compile.image.expected import Rates
from spikeport.errors import UsageError


def parse(texts: list[str]) -> Rates | None:
    """Return the rates that the texts state; None if there are none.

    Raises
    ------
    UsageError
        If a text is neither RATE nor NAME=RATE, or a rate is stated twice.
    """
    if not texts:
        return None
    stated: dict[str, float] = {}
    for text in texts:
        name, _, number = text.rpartition("=")
        if name in stated:
            raise UsageError(f"--rate-hz {text}: the rate of {name or 'all'} is stated twice")
        stated[name] = _number(number, text)
    return Rates(stated.pop("", None), stated)


def _number(number: str, text: str) -> float:
    try:
        return float(number)
    except ValueError:
        raise UsageError(
            f"--rate-hz {text}: expected a rate in Hz, or NAME=RATE for an ensemble"
        ) from None
