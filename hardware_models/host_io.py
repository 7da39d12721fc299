"""Host input and output: the traffic of a step, and whether dt is known to be long enough for it.

Published times are for whole steps in which host and chip exchange any number of spikes and values;
no time per spike is known. They are never added to the time that a chip takes by itself.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

from spikeport.constants import BITS_PER_BYTE
from spikeport.counted import counted
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.estimate import Estimate

Verdict = Literal["shown", "not shown", "excluded"]
Basis = Literal["run", "all rates", "rates on the chip"]
"""The origin of counts: a run, or stated rates, of the host's sources too or of neurons alone."""


@dataclass(frozen=True)
class HostTraffic:
    """Traffic of an image with its host in each step.

    Attributes
    ----------
    dt_s : float
        The time step, in s.
    sources : int
        Sources of spikes on the host.
    spikes : float
        Expected spikes in a step of the sources that encode values, for values that are spread
        evenly over their range.
    unknown_sources : int
        Sources that send spikes instead of encoding values; their rates are unknown before a run.
    values_back, spikes_back : int
        Currents and voltages that are read in every step, and compartments whose spikes are read.
    words_back : tuple of int
        Words in which each chip sends these: see `spikeport.compile.image.host_traffic`.
    errors : int
        Values of learning errors that are sent in every step.
    """

    dt_s: float
    sources: int
    spikes: float
    unknown_sources: int
    values_back: int
    spikes_back: int
    words_back: tuple[int, ...]
    errors: int


@dataclass(frozen=True)
class HostIoReport:
    """Host input and output of a step, and a verdict on steps of this length.

    Attributes
    ----------
    counted : bool
        True if spikes are those of a run, False if they are expected.
    sources, unknown_sources : int
        Sources of spikes on the host, and the number of them whose rates are neither known before
        a run nor stated.
    spikes : float
        Mean of the host's spikes in a step.
    most_spikes : int or None
        The host's most spikes in a step of a run.
    values_back, spikes_back, words_back, errors : int
        As in `HostTraffic`, with the words of all chips.
    bytes_back : int or None
        Bytes of the packets that hold the words; None: the chip has no public packet.
    dt_s : float
        Length of a step, in s.
    published : Estimate or None
        Published time of a step in which host and chip communicate, in s; None: there is none.
    verdict : {"shown", "not shown", "excluded"}
        The evidence that host and chip keep up with ``dt_s``.
    reason : str
        The reason in words.
    """

    counted: bool
    sources: int
    unknown_sources: int
    spikes: float
    most_spikes: int | None
    values_back: int
    spikes_back: int
    words_back: int
    bytes_back: int | None
    errors: int
    dt_s: float
    published: Estimate | None
    verdict: Verdict
    reason: str

    @property
    def dt_in_words(self) -> str:
        """The length of a step, in words."""
        return f"dt = {1000 * self.dt_s:g} ms"

    def rows(self) -> Iterator[tuple[str, str]]:
        """Yield names and figures, in words: the rows of a table."""
        mean = f"{self.spikes:,.1f} {'on average' if self.counted else 'expected'}"
        most = "" if self.most_spikes is None else f", {self.most_spikes:,} at most"
        unknown = "" if self.counted else _unknown(self.unknown_sources)
        yield "spikes in", f"{mean}{most}, of {counted(self.sources, 'source')}{unknown}"
        packets = f", {self.bytes_back:,} bytes in whole packets" if self.bytes_back else ""
        what = f"{counted(self.values_back, 'value')}, {counted(self.spikes_back, 'spike')}"
        yield "read back", f"{counted(self.words_back, 'word')} ({what}){packets}"
        if self.errors:
            yield "learning errors in", counted(self.errors, "value")
        if self.published is not None:
            yield "published", f"{self.published.format()}: {self.published.source}"
        yield self.dt_in_words, f"{self.verdict}: {self.reason}"

    def to_dict(self) -> dict[str, object]:
        """Return plain data, ready for JSON."""
        return asdict(self)

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> "HostIoReport":
        """Return the report from plain data, see `to_dict`."""
        published = data["published"]
        figure = None if published is None else Estimate(**published)
        return cls(**{**data, "published": figure})


def host_io(
    traffic: HostTraffic,
    chip: ChipModel,
    activity: Activity | None = None,
    basis: Basis = "run",
) -> HostIoReport:
    """Return the host's input and output on a chip.

    Parameters
    ----------
    traffic : HostTraffic
        The values and spikes that cross in each step.
    chip : ChipModel
        The chip, with its published figures.
    activity : Activity, optional
        The counts of a run, or those expected of one.
    basis : {"run", "all rates", "rates on the chip"}
        The origin of the activity's counts.
    """
    is_run = activity is not None and basis == "run"
    sent = None if activity is None else activity.from_host
    # Rates of ensembles alone say nothing of sources that send spikes.
    known = activity is not None and basis == "all rates"
    verdict, reason = _judged(traffic, chip)
    return HostIoReport(
        counted=is_run,
        sources=traffic.sources,
        unknown_sources=0 if known else traffic.unknown_sources,
        spikes=traffic.spikes if sent is None else sent.mean,
        most_spikes=int(sent.most) if sent is not None and is_run else None,
        values_back=traffic.values_back,
        spikes_back=traffic.spikes_back,
        words_back=sum(traffic.words_back),
        bytes_back=_bytes(traffic.words_back, chip),
        errors=traffic.errors,
        dt_s=traffic.dt_s,
        published=None if chip.host_io is None else chip.host_io.step.estimate,
        verdict=verdict,
        reason=reason,
    )


def _bytes(words: Sequence[int], chip: ChipModel) -> int | None:
    """Return the bytes of whole packets that hold each chip's words; None if not public."""
    published = chip.host_io
    if published is None or published.packet is None or published.word is None:
        return None
    # A packet is read whole, however few of its words are in use.
    packet = published.packet.count
    n_packets = sum(-(-n_words // packet) for n_words in words)
    return n_packets * packet * published.word.count // BITS_PER_BYTE


def _judged(traffic: HostTraffic, chip: ChipModel) -> tuple[Verdict, str]:
    """Return whether host and chip keep up with a step, and why.

    An upper bound within dt shows it, a lower bound beyond dt excludes it; an unknown bound does
    neither.
    """
    if not (traffic.sources or traffic.words_back or traffic.errors):
        return "shown", "nothing crosses between host and chip"
    if chip.host_io is None:
        return "not shown", "no figure is published"
    # Only an interval on one side of dt decides.
    step = chip.host_io.step.estimate
    if step.high is not None and step.high <= traffic.dt_s:
        return "shown", f"published steps with host I/O take {_ms(step.high)} at most"
    if step.low is not None and step.low > traffic.dt_s:
        return "excluded", f"published steps with host I/O take {_ms(step.low)} at least"
    bounds = [_ms(bound) for bound in (step.low, step.high) if bound is not None]
    published = " to ".join(bounds) if len(bounds) == 2 else _ms(step.value)
    return "not shown", f"published steps with host I/O take {published}"


def _unknown(sources: int) -> str:
    return f"; not counting the spikes of {sources:,} with unknown rates" if sources else ""


def _ms(seconds: float) -> str:
    return f"{1000 * seconds:g} ms"
