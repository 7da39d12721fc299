"""The loss of a network's outputs to rounding: a run on float and on integer blocks.

    error = rms(filtered(output) - filtered(float output)) / rms(filtered(float output))

over all outputs and steps, with float output from float blocks of the compiled network. A part's
error is the error of a run in which this part alone is rounded; its share is its squared error over
the sum of all squared errors. `spikeport.backends.loss` measures them. The loss to passes, filters
and relays is measured against the network as it was written, in float Nengo, by
`spikeport.backends.against_float`.
"""

from dataclasses import dataclass

from spikeport.compile.check import rules
from spikeport.compile.check.lost_values import input_hints, readout_hints
from spikeport.compile.check.violation import Violation
from spikeport.hardware_models.estimate import plain

ALIASED = 0.25
"""Relative error of rates above which a hint is due."""


@dataclass(frozen=True)
class LossPart:
    """One cause of loss: ``what`` of an ensemble or relay is rounded, and the effect on outputs.

    ``rounding`` is the relative rms error of the rounded numbers, ``output_error`` the relative rms
    error of the outputs, ``share`` the share of the outputs' squared error.
    """

    object: str
    what: str
    rounding: float
    output_error: float
    share: float


@dataclass(frozen=True)
class Loss:
    """The result of a run on float and on integer blocks.

    Parameters
    ----------
    n_steps : int
        Steps of the run.
    tau_s : float
        Time constant of the filter the outputs are compared through.
    network_error : float or None
        Error of the probes against the network as it was written, in float Nengo; None where no
        value is probed, none was sampled in the time, all are 0 in float, or input is random and
        has no seed.
    output_error : float
        Error of the integer blocks.
    floor : float
        Error that a change in the last bit of the float blocks makes: some spikes come a step
        earlier. Errors near the floor say nothing of their cause.
    parts : tuple of LossPart
        The causes, largest share first.
    aliasing : mapping of str to float
        Relative rms difference of an ensemble's rates on the chip, whose intervals are whole steps,
        from those of its neuron type. Decoders are solved for the rates on the chip.
    readout_spikes : int
        Spikes of read-outs, each of which is a value lost.
    saturated_inputs : mapping of str to float
        For each input of values that lost spikes, the share of steps in which its busiest source
        lost some.
    """

    n_steps: int
    tau_s: float
    network_error: float | None
    output_error: float
    floor: float
    parts: tuple[LossPart, ...]
    aliasing: dict[str, float]
    readout_spikes: int
    saturated_inputs: dict[str, float]

    @property
    def hints(self) -> tuple[Violation, ...]:
        """The hints on causes of loss that have a cure."""
        found = [*readout_hints(self.readout_spikes, self.n_steps)]
        found += [
            rules.get("SP407").broken(name, f"{100 * error:.0f} % off")
            for name, error in self.aliasing.items()
            if error > ALIASED
        ]
        return (*found, *input_hints(self.saturated_inputs))

    def to_dict(self) -> dict[str, object]:
        """Return plain data, ready for JSON."""
        return plain(self)
