"""``spikeport board``: be a board, and look into records of boards."""

import functools
from pathlib import Path

import numpy as np
import typer

from spikeport.atomic import check_output
from spikeport.backends.board.address import Address
from spikeport.backends.board.board import CountingChip, Machine
from spikeport.backends.board.faults import FAULTS
from spikeport.backends.board.messages import SPIKES
from spikeport.backends.board.record import Record
from spikeport.backends.board.server import Service
from spikeport.backends.board.server import serve as serve_board
from spikeport.commands.ending import ended_in_order
from spikeport.commands.links import certificates
from spikeport.commands.options_of_links import BoardService, Tls
from spikeport.commands.process import say
from spikeport.compile.image.chip_image import ChipImage
from spikeport.counted import counted
from spikeport.errors import ImageError, UsageError, printable, reason_of, unknown


def _native(image: ChipImage, seed: int) -> CountingChip:
    from spikeport.backends.native.chip import NativeChip

    return NativeChip(image, seed)


def _nengo_loihi(image: ChipImage, seed: int) -> CountingChip:
    # It needs Nengo, a native board does not.
    from spikeport.backends.nengo_loihi import NengoLoihiChip

    return NengoLoihiChip(image, seed)


def _snips(image: ChipImage, seed: int) -> CountingChip:
    from spikeport.backends.board.nxsdk.chip import NxsdkChip, snips_hardware

    return NxsdkChip(image, seed, snips_hardware, _say_of_board)


def _nxsdk(image: ChipImage, seed: int) -> CountingChip:
    from spikeport.backends.board.nxsdk.chip import NxsdkChip
    from spikeport.backends.board.nxsdk.hardware import real_hardware

    return NxsdkChip(image, seed, real_hardware, _say_of_board)


def _rtl(image: ChipImage, seed: int) -> CountingChip:
    from spikeport.backends.softcore.chip import RtlChip

    return RtlChip(image, seed, _say_of_board)


def _on_device(path: Path, baud: int, image: ChipImage, seed: int) -> CountingChip:
    from spikeport.backends.softcore.chip import DeviceChip
    from spikeport.backends.softcore.line import SerialLine

    return DeviceChip(image, seed, SerialLine(path, baud), _say_of_board)


def _kept(path: Path, machine: Machine, image: ChipImage, seed: int) -> CountingChip:
    try:
        image.save(path)
    except OSError as error:
        # Reported to the host, like a read-only folder: a full disk must not end the server.
        raise UsageError(
            f"--keep {path}: cannot be written ({reason_of(error)}); choose another place"
        ) from None
    return machine.load(image, seed)


def _check_keep(path: Path) -> None:
    """Refuse to replace anything but the image of an earlier session."""
    check_output("--keep", path)
    try:
        if path.exists():
            ChipImage.load(path)
    except ImageError:
        raise UsageError(
            f"--keep {path}: exists, and is not a chip image; choose another"
        ) from None


def _need_gcc() -> None:
    from spikeport.backends.board.nxsdk.compiled import require_gcc

    require_gcc()


def _need_verilator() -> None:
    from spikeport.backends.softcore.verilated import require_verilator

    require_verilator()


def _need_nxsdk() -> None:
    from spikeport.backends.board.nxsdk.hardware import require_nxsdk

    require_nxsdk()


NATIVE = "native"
MACHINES = {
    NATIVE: _native,
    "nengo-loihi": _nengo_loihi,
    "snips": _snips,
    "nxsdk": _nxsdk,
    "rtl": _rtl,
}
NEEDS = {"snips": _need_gcc, "nxsdk": _need_nxsdk, "rtl": _need_verilator}
"""Checks for the programs that a machine needs, made before a host connects."""


def _machine(request: BoardService) -> Machine:
    """Return the requested machine; raise an error if it needs a program that is missing."""
    asked = request.device is not None, request.rtl, request.machine is not None
    if sum(asked) > 1:
        raise UsageError(
            "--device, --rtl and --machine each choose what the board is; give one of them"
        )
    if request.device is None and request.baud is not None:
        raise UsageError("--baud: only a serial line has a rate; cure: --device, or leave it out")
    if request.device is not None:
        from spikeport.backends.softcore.line import BAUD, SerialLine

        baud = BAUD if request.baud is None else request.baud
        SerialLine(request.device, baud).close()
        return Machine("softcore", functools.partial(_on_device, request.device, baud))
    name = "rtl" if request.rtl else request.machine or NATIVE
    if name not in MACHINES:
        raise unknown("machine", name, MACHINES)
    if name in NEEDS:
        NEEDS[name]()
    return Machine(name, MACHINES[name])


def serve(request: BoardService, tls: Tls) -> None:
    """Serve a board until the process is ended, then remove its socket."""
    machine = _machine(request)
    if request.keep is not None:
        _check_keep(request.keep)
        request.keep.parent.mkdir(parents=True, exist_ok=True)
        machine = Machine(machine.name, functools.partial(_kept, request.keep, machine))
    service = Service(
        address=Address.parse(request.listen),
        machine=machine,
        certificates=certificates(tls),
        allow_remote=request.allow_remote,
        faults=[FAULTS.parse(text) for text in request.fault],
        once=request.once,
        idle_s=request.idle,
    )
    with ended_in_order(serves=True):
        serve_board(service, say)


def _say_of_board(line: str) -> None:
    say(f"board: {line}")


def inspect(path: Path) -> int:
    """Print image, machine, steps, spikes and holds of a record, and return the exit code."""
    record = Record(path)
    steps, held, sent_bytes = 0, 0, []
    for step in record.steps():
        steps += 1
        held += step.answer is None
        if len(step.sent) < SPIKES.size:
            raise UsageError(
                f"{path}: step {steps}: the step's body is cut: {len(step.sent)} bytes, and it "
                f"begins with {SPIKES.size}"
            )
        spikes_bytes, _ = SPIKES.unpack_from(step.sent)  # learning errors follow
        sent_bytes.append(spikes_bytes)
    session = record.session
    digest, runs = printable(session.digest[:12]), printable(session.runs)
    typer.echo(f"image {digest}, seed {session.seed}, on {runs}")
    mean = np.mean(sent_bytes) if steps else 0.0
    typer.echo(
        f"{counted(steps, 'step')}, of which {held:,} held; {mean:.0f} bytes of spikes a step"
    )
    if record.whole and record.totals is not None:
        typer.echo("whole: the session ended as it should")
    elif record.whole:
        typer.echo("whole, but the session was broken off: there are no totals")
    else:
        typer.echo(f"cut or damaged after step {steps:,}")
    return int(not record.whole)
