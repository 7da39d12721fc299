"""Arguments of `nengo_loihi.Simulator`: taken as they apply here, or refused with a reason.

docs/migrating.md lists them in a table.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from spikeport.backends import registry
from spikeport.compile.ground.refusal import ArgumentError
from spikeport.compile.loihi.build_settings import AS_USUAL, BuildSettings
from spikeport.errors import UsageError
from spikeport.reading.mismatch import shown

if TYPE_CHECKING:
    from nengo_loihi.builder import Model

WITHOUT_CHIP = "reference"


def check_target(target: object, backend: str) -> None:
    """Check ``target``: ``"sim"`` goes with any backend that has a chip.

    Raises
    ------
    UsageError
        For a board, the float emulation, or an emulator on a backend without a chip.
    """
    if target == "loihi":
        raise UsageError(
            "target='loihi': a board is a backend here; give backend='board', which starts a stub, "
            "or with link=LinkOptions(board=ADDRESS) reaches one that `spikeport board serve` runs"
        )
    if target == registry.FLOAT_EMULATION:
        registry.get(registry.FLOAT_EMULATION)  # raises an error with its replacement
    if target not in (None, "sim"):
        raise ArgumentError("target", target, "None or 'sim'; see backend")
    if target == "sim" and backend == WITHOUT_CHIP:
        raise UsageError(
            "target='sim' needs an emulated chip, which backend='reference' lacks; leave "
            "one of them out"
        )


def check_precompute(precompute: object) -> None:
    """Check ``precompute``, which changes nothing: host and chip step in turn in any case."""
    if not isinstance(precompute, bool | None):
        raise ArgumentError("precompute", precompute, "None, or a bool, which changes nothing here")


def check_hardware_options(options: object) -> None:
    """Refuse options of boards; UsageError names them."""
    if not isinstance(options, Mapping | None):
        raise ArgumentError("hardware_options", options, "None, or a mapping")
    if options:
        names = ", ".join(sorted(map(str, options)))
        raise UsageError(
            f"hardware_options: {names}: options of NxSDK belong to the process that serves the "
            "board, `spikeport board serve --machine nxsdk`; leave them out"
        )


def check_sample_times(dt: object) -> None:
    """Refuse ``dt`` of `trange`, the old name of ``sample_every``; UsageError has the new call."""
    if dt is not None:
        expected = "None: the name is sample_every, as in Nengo since 3.0; cure: "
        raise ArgumentError("dt", dt, f"{expected}trange(sample_every={shown(dt)})")


def build_settings(model: "Model | None", dt: float, remove_passthrough: bool) -> BuildSettings:
    """Return the settings of a build, from nengo-loihi's model if there is one.

    Raises
    ------
    UsageError
        If ``model`` is not such a model, has another time step, or was built already.
    """
    from nengo_loihi.builder import Model

    if not isinstance(remove_passthrough, bool):
        raise ArgumentError("remove_passthrough", remove_passthrough, "a bool")
    if model is None:
        return BuildSettings(remove_passthrough) if not remove_passthrough else AS_USUAL
    if not isinstance(model, Model):
        raise ArgumentError("model", model, "None, or a nengo_loihi.builder.Model")
    if model.dt != dt:
        raise UsageError(
            f"model: its dt is {model.dt:g} s, the simulator's {dt:g} s; make them equal"
        )
    if model.blocks or model.inputs or model.probes or model.toplevel is not None:
        raise UsageError(
            f"model: {len(model.blocks)} blocks are built in it already, and spikeport builds the "
            "network itself; give a fresh nengo_loihi.builder.Model, whose settings are taken"
        )
    return BuildSettings.of(model, remove_passthrough)
