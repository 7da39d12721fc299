"""A board of NxSDK in a process of its own: counts of differences, and messages of failures."""

import multiprocessing
import os
import shutil
import signal
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spikeport.backends.board.nxsdk.chip import NxsdkChip, snips_hardware
from spikeport.backends.board.nxsdk.hardware import HardwareModules
from spikeport.errors import BackendError, MissingExtraError
from tests.helpers.images import Block, Output, Parts

RAMP = Parts(
    [Block(2, bias=[64, 0], vth=1280, refract_delay=2)],
    inputs=[],
    outputs=[Output("spiked", [0, 1]), Output("voltage", [0, 1])],
).image()
"""A voltage that is 256, as in a spike, once on its way to each spike."""


def dies() -> HardwareModules:
    os._exit(7)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("g++") is None, reason="compiles nengo-loihi's snips with g++")
def test_phantom_spikes_are_told_from_other_differences() -> None:
    lines: list[str] = []
    chip = NxsdkChip(RAMP, 0, snips_hardware, lines.append)
    spikes = [chip.step(np.zeros(0, dtype=int), {})[0].tolist() for _ in range(60)]
    n_spikes = chip.activity().totals()["spikes"]
    chip.close()
    assert lines == [
        "240 values read; other than the native chip's: 3 phantom spikes, "
        "2 voltages of refractory neurons, 0 more"
    ]
    assert sum(first for first, _ in spikes) == n_spikes + 3
    assert n_spikes == 2


@pytest.mark.slow
def test_a_process_that_dies_is_reported_with_its_exit_code() -> None:
    with pytest.raises(BackendError, match="the board's process ended with exit code 7"):
        NxsdkChip(RAMP, 0, dies)


@pytest.mark.slow
def test_an_error_of_the_board_s_process_is_raised_in_the_caller() -> None:
    with pytest.raises(MissingExtraError, match="no NxSDK is installed here"):
        NxsdkChip(RAMP, 0)


def never() -> HardwareModules:
    time.sleep(60)
    raise AssertionError


@pytest.mark.slow
def test_a_board_that_is_not_built_in_time_is_given_up_with_its_process(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("spikeport.backends.board.nxsdk.chip.BUILD_S", 0.1)
    monkeypatch.setattr("spikeport.backends.board.nxsdk.chip.END_S", 0.1)
    before = set(multiprocessing.active_children())
    with pytest.raises(BackendError, match=r"the board's process does not answer within 0\.1 s"):
        NxsdkChip(RAMP, 0, never)
    assert set(multiprocessing.active_children()) == before


class Shut:
    """A stand-in for nengo-loihi's interface to a board; it notes that it was shut down."""

    def __init__(self, *_: object, **__: object) -> None:
        self.connect = lambda: None
        self.run_steps = lambda *_, **__: None
        self.host2chip = self.chip2host = lambda *_: None
        self.snips = SimpleNamespace(probe_data={})

    def close(self) -> None:
        Path(os.environ["SHUT_DOWN"]).touch()


def stand_in() -> HardwareModules:
    interface: Any = SimpleNamespace(HardwareInterface=Shut, HostSnip=SimpleNamespace())
    return HardwareModules(None, interface)


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
def test_after_ctrl_c_a_board_still_steps_and_is_shut_down(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SHUT_DOWN", str(tmp_path / "shut"))
    image = Parts([Block(2, bias=[64, 0], vth=1280, refract_delay=2)], inputs=[]).image()
    chip = NxsdkChip(image, 0, stand_in)
    pid = chip._process.pid
    assert pid is not None
    os.kill(pid, signal.SIGINT)  # a terminal sends it to all of its processes
    assert chip.step(np.zeros(0, dtype=int), {}) == []
    chip.close()
    assert chip._process.exitcode == 0  # 1 after a KeyboardInterrupt that nothing caught
    assert (tmp_path / "shut").exists()
