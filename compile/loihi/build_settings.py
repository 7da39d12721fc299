"""Settings of a whole build, which nengo-loihi keeps as attributes of its `Model`."""

from dataclasses import dataclass, fields
from typing import Annotated

from nengo_loihi.builder import Model
from nengo_loihi.decode_neurons import DecodeNeurons, OnOffDecodeNeurons, Preset10DecodeNeurons
from pydantic import Field

from spikeport.compile.ground.refusal import ArgumentError
from spikeport.key_values import check_fields

BY_PASSES = (
    "remove_passthrough",
    "intercept_limit",
    "vth_nonspiking",
    "decode_tau",
    "decode_neurons",
)
"""Settings for which the passes that rewrite networks assume the defaults."""


@dataclass(frozen=True)
class BuildSettings:
    """The settings of a build; names, meanings and defaults are those of nengo-loihi's `Model`.

    Attributes
    ----------
    remove_passthrough : bool
        Replace passthrough nodes between ensembles on the chip by connections; else they stay on
        the host.
    pes_error_scale : float
        Factor of the errors of PES, which are then rounded and clipped to -127 to 127.
    pes_wgt_exp : int
        Exponent of the weights that learn, from -7 to 7: a larger one allows larger weights, in
        coarser steps.
    decode_tau : float
        Time constant of the filter behind decode neurons, in s.
    intercept_limit : float
        Largest intercept; larger intercepts are set to it.
    vth_nonspiking : float
        Threshold of compartments that are read out, in units of the decoded value.
    decode_neurons : DecodeNeurons or None
        The decode neurons between ensembles; None for ten pairs a dimension.
    node_neurons : DecodeNeurons or None
        The neurons that send values of the host as spikes; None for one pair a dimension.
    """

    remove_passthrough: bool = True
    pes_error_scale: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 100.0
    pes_wgt_exp: Annotated[int, Field(ge=-7, le=7)] = 4
    decode_tau: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.005
    intercept_limit: Annotated[float, Field(lt=1, allow_inf_nan=False)] = 0.95
    vth_nonspiking: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 10
    decode_neurons: DecodeNeurons | None = None
    node_neurons: DecodeNeurons | None = None

    def __post_init__(self) -> None:
        """Refuse numbers out of bounds, and node neurons that an image cannot describe."""
        check_fields(self, "")
        # nengo-loihi accepts other kinds, but fails while it builds them, or sends other spikes.
        pairs = getattr(self.node_neurons, "pairs_per_dim", 1)
        if self.node_neurons is not None and (
            type(self.node_neurons) is not OnOffDecodeNeurons or pairs != 1
        ):
            expected = (
                "OnOffDecodeNeurons with one pair a dimension, which is what an image can describe"
            )
            raise ArgumentError("node_neurons", str(self.node_neurons), expected)

    @classmethod
    def of(cls, model: Model, remove_passthrough: bool = True) -> "BuildSettings":
        """Return the settings of one of nengo-loihi's models."""
        values = {name: getattr(model, name) for name in _of_model()}
        return cls(remove_passthrough=remove_passthrough, **values)

    def set_on(self, model: Model) -> None:
        """Write the settings into a model that is to be built."""
        for name in _of_model():
            if (value := getattr(self, name)) is not None:
                setattr(model, name, value)

    def check_written(self) -> None:
        """Raise `ArgumentError` for a setting that passes which rewrite networks do not respect."""
        for name in BY_PASSES:
            value = getattr(self, name)
            # A model of nengo-loihi has these decode neurons unless they are replaced.
            if type(value) is Preset10DecodeNeurons:
                continue
            if value != getattr(BuildSettings, name):
                expected = (
                    f"{getattr(BuildSettings, name)!r}, which the passes that rewrite networks "
                    "assume; or choose a pipeline without these passes: as_written"
                )
                raise ArgumentError(name, value, expected)


def _of_model() -> list[str]:
    return [one.name for one in fields(BuildSettings) if one.name != "remove_passthrough"]


AS_USUAL = BuildSettings()
"""nengo-loihi's defaults."""
