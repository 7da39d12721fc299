"""A device on nengo-loihi's hardware half: the spikes and errors it sends, and refusals."""

from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.backends.board.nxsdk.answer import recv_bytes
from spikeport.backends.board.nxsdk.device import RETRIES, Device
from spikeport.backends.board.nxsdk.hardware import HardwareModules
from spikeport.errors import BackendError
from tests.helpers.images import Block, Group, Output, Parts, Route


class Hardware:
    """nengo-loihi's hardware interface, as far as a device calls it; it answers step numbers."""

    def __init__(self, model, **settings) -> None:
        self.model, self.settings = model, settings
        self.sent: list = []
        self.calls: list[object] = []
        self.snips = SimpleNamespace(probe_data={probe: [] for probe in model.probes})

    def connect(self) -> None:
        self.calls.append("connect")

    def run_steps(self, steps: int, blocking: bool) -> None:
        self.calls.append(blocking)

    def host2chip(self, spikes, errors) -> None:
        self.sent.append((spikes, errors))

    def chip2host(self, receivers) -> None:
        for values in self.snips.probe_data.values():
            values.append(np.array([[len(self.sent)]], dtype=np.uint8))

    def close(self) -> None:
        self.calls.append("close")


def modules(hardware: type = Hardware) -> HardwareModules:
    snip = SimpleNamespace(recv_retries=10)
    return HardwareModules(None, SimpleNamespace(HardwareInterface=hardware, HostSnip=snip))


LEARNS = Parts(
    [Block(4)],
    [Group([[64] * 4], learning=(1, 1, -7, 10, 2.5, 2, 4))],
    [2],
    [Route([0, 0], input=0)],
    [Output("voltage", [1])],
).image()


def test_spikes_and_all_errors_are_sent_in_each_step() -> None:
    imported = modules()
    device = Device(LEARNS, imported, 3)
    hardware = device._interface
    assert hardware.settings["snip_max_spikes_per_step"] == 2
    assert (hardware.settings["n_chips"], hardware.settings["seed"]) == (1, 3)
    assert imported.interface.HostSnip.recv_retries == RETRIES
    assert imported.interface.HostSnip.recv_bytes is recv_bytes
    assert [held.tolist() for held in device.step(np.array([1]), {})] == [[1]]
    device.step(np.array([], dtype=int), {0: np.array([0.5, -0.5])})
    held = device.step(np.array([], dtype=int), {})  # without an error, as the native chip
    assert held[0].dtype == np.int32
    spikes = [[s.tolist() for _, _, s in sent] for sent, _ in hardware.sent]
    errors = [[e.tolist() for _, _, e in errors] for _, errors in hardware.sent]
    assert spikes == [[[1]], [[]], [[]]]
    assert errors == [[[0, 0]], [[0.5, -0.5]], [[0, 0]]]
    device.close()
    assert hardware.calls == ["connect", False, "close"]


def test_spikes_that_the_board_would_drop_are_refused() -> None:
    device = Device(LEARNS, modules(), 3)
    device.step(np.array([0, 0]), {})
    with pytest.raises(BackendError, match=r"step 2: sources .* send 3 spikes, limit 2, one for"):
        device.step(np.array([0, 1, 1]), {})


def test_a_board_that_is_connected_and_does_not_start_is_shut_down() -> None:
    class Stuck(Hardware):
        made: Hardware

        def run_steps(self, steps: int, blocking: bool) -> None:
            Stuck.made = self
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Device(LEARNS, modules(Stuck), 3)
    assert Stuck.made.calls == ["connect", "close"]


def test_a_board_whose_host_is_gone_is_disconnected() -> None:
    device = Device(LEARNS, modules(), 3)
    disconnected: list[bool] = []

    def close() -> None:
        raise BrokenPipeError

    device._interface.close = close
    device._interface.nxsdk_board = SimpleNamespace(disconnect=lambda: disconnected.append(True))
    device.close()
    assert disconnected == [True]


def test_an_image_that_falls_into_a_trap_is_refused_with_the_finding() -> None:
    image = Parts([Block(1), Block(1, vmin=-1)]).image()
    with pytest.raises(BackendError, match=r"^NX03 refused: voltage ranges of a core: core 0"):
        Device(image, modules(), 0)


def test_a_refusal_of_nengo_loihi_is_quoted() -> None:
    def refuse(*_args: object, **_settings: object) -> None:
        raise AssertionError("too many")

    with pytest.raises(BackendError, match=r"hardware half refuses the image \(refuse: too many\)"):
        Device(LEARNS, modules(refuse), 0)  # type: ignore[arg-type]
