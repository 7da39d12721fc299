"""Loaders to fuzz, by name, each with a function that writes good files for it."""

import binascii
import shutil
import socket
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import nengo
import numpy as np
import pytest
import torch
import xarray as xr
import yaml
from torch import nn

from spikeport import cache, compile_network, nir
from spikeport.backends import kept
from spikeport.backends.board.board import Board, pieces
from spikeport.backends.board.chip import BoardChip
from spikeport.backends.board.frame import Frame, Kind, Splitter
from spikeport.backends.board.hello import Hello
from spikeport.backends.board.messages import Codec
from spikeport.backends.board.nxsdk.answer import recv_bytes
from spikeport.backends.board.record import SessionRecorder
from spikeport.backends.kept import CompileRequest
from spikeport.backends.replay import ReplayChip
from spikeport.backends.softcore import port
from spikeport.backends.softcore.port import Held, Output
from spikeport.commands import report_file, view
from spikeport.commands.agreement import spikes_of
from spikeport.commands.diff import changes
from spikeport.commands.step import by_step
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.loihi.build_settings import AS_USUAL
from spikeport.compile.loihi.events import event_steps
from spikeport.compile.passes.parse import parse
from spikeport.digest import digest_of
from spikeport.errors import BackendError, UsageError
from spikeport.experiments import calibration
from spikeport.experiments.calibration import DecoderCalibration
from spikeport.experiments.evaluate.comparison import compare, is_evaluation
from spikeport.experiments.evaluate.interval import of_mean, of_share
from spikeport.experiments.evaluate.table import TableRow
from spikeport.experiments.policy.observations import read_observations
from spikeport.experiments.run_folder import write_dataset
from spikeport.experiments.sweep.folder import SweepFolder, opened
from spikeport.experiments.sweep.plan import Sweep
from spikeport.experiments.switch import schedule
from spikeport.experiments.walk.path_file import read_path
from spikeport.files import write_json
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import BUILT_IN
from spikeport.networks import walking_policy
from spikeport.networks.loading.files import load_mlp
from spikeport.networks.loading.nir.populations import PopulationGraph
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.reading import npz
from spikeport.reading.mismatch import MismatchError
from spikeport.reading.notebook import read_notebook
from spikeport.robot.link.codec import (
    COMMAND,
    STATE,
    Base,
    Command,
    decode_base,
    decode_command,
    decode_state,
    encode_base,
    encode_command,
    encode_state,
)
from spikeport.robot.link.h1 import check_commands
from spikeport.robot.link.remote import decode
from spikeport.robot.link.requests import (
    Request,
    Response,
    decode_request,
    decode_response,
    encode_request,
    encode_response,
)
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.link.sport_mode import CHECK_MODE, EMPTY, Answer, SportModeRelease
from spikeport.robot.link.wire import MessageError
from spikeport.robot.plant import Plant
from spikeport.robot.signals import MotorCommands, Sensors
from spikeport.training import checkpoint as training
from tests.helpers import nir_graphs
from tests.helpers.evaluations import write_evaluation
from tests.helpers.event_files import process_of, random_events, write_events
from tests.helpers.fake_board import MACHINE, FakeClock, FakeLine, small_image, spike_train
from tests.helpers.foreign import ENVIRONMENT, Policy, described, state
from tests.helpers.forging import good
from tests.helpers.standing_robot import remote
from tests.helpers.sweeps import result

SCHEDULE = Path(schedule.__file__).with_name("switch.toml")


class Loader(NamedTuple):
    """A function that reads a file, and one that writes good files into a folder."""

    write: Callable[[Path], object]
    load: Callable[[Path], object]


def _npz(folder: Path) -> None:
    rng = np.random.default_rng(0)
    weights = (rng.standard_normal((4, 5)), rng.standard_normal((2, 4)))
    biases, joints = (np.zeros(4), np.zeros(2)), ("left", "right")
    WalkingPolicy(weights, biases, joints, np.zeros(2), 0.5).save(folder / "policy.npz")


def _torchscript(folder: Path) -> None:
    module = Policy().eval()
    scripted = torch.jit.script(module)
    scripted.save(folder / "scripted.pt")
    torch.jit.freeze(scripted).save(folder / "frozen.pt")
    torch.jit.trace(module, torch.zeros(1, 5)).save(folder / "traced.pt")


def _checkpoint(folder: Path) -> None:
    normaliser = {"obs_normalizer._mean": torch.ones(1, 5), "obs_normalizer._std": torch.ones(1, 5)}
    content = {"actor_state_dict": state(**normaliser), "iter": 3, "infos": None}
    torch.save(content, folder / "zip.pt")
    torch.save(content, folder / "old.pt", _use_new_zipfile_serialization=False)


def _training(folder: Path) -> None:
    learner = {"actor": state(), "iter": 3}
    entry = {"segment": 1, "step": 32, "stage": "walk"}
    training.save(folder, training.Checkpoint({"seed": 0}, 1, learner, [entry]))
    training.path_of(folder, 1).rename(folder / "00001.pt")
    (folder / "checkpoints").rmdir()


def _onnx(folder: Path) -> None:
    layers = nn.Hardtanh(-2, 2), nn.Linear(5, 4), nn.ELU(), nn.Linear(4, 3), nn.Tanh()
    policy = nn.Sequential(*layers).eval()
    for name, beside in (("whole", False), ("beside", True)):
        path, inputs = folder / f"{name}.onnx", (torch.zeros(1, 5),)
        torch.onnx.export(policy, inputs, path, external_data=beside, verbose=False)


def _description(folder: Path) -> None:
    (folder / "env.yaml").write_text(yaml.dump(ENVIRONMENT, sort_keys=False))


def _image(folder: Path) -> None:
    good().save(folder / "image.npz")


MADE_FOR, SHAPES = {"experiment": "reach", "m1": 100}, {"arm": (2, 3)}


def _calibration(folder: Path) -> None:
    decoders = {name: np.ones(shape) for name, shape in SHAPES.items()}
    DecoderCalibration(MADE_FOR, "0" * 64, decoders).save(folder / "c.npz")


def _observations(folder: Path) -> None:
    np.savez(folder / "observations.npz", observations=np.ones((5, 3)))


def _path(folder: Path) -> None:
    rows = "".join(f"{t / 2},{t / 10},0\n" for t in range(20))
    (folder / "path.csv").write_text("t_s,x_m,y_m\n" + rows)
    (folder / "utf-16.csv").write_text("t_s,x_m,y_m\n" + rows, encoding="utf-16")


def _run(folder: Path) -> None:
    rest = Plant().data.qpos
    series = {
        "qpos": (("time", "coordinate"), np.tile(rest, (3, 1))),
        "gates": (("time", "gate"), np.ones((3, 2)), {"units": "1"}),
        "a_spike_time": ("spike", [0.001, 0.002]),
        "a_spike_neuron": ("spike", [1, 2]),
    }
    coordinates = {"time": [0.0, 0.001, 0.002], "gate": ["arm", "legs"]}
    write_dataset(folder / "probes.nc", xr.Dataset(series, coordinates))


def _viewed(path: Path) -> None:
    view.write(path, path.with_suffix(".html"), "run")


def _remote(folder: Path) -> None:
    (folder / "keys.remote").write_bytes(remote("start", "L1"))


def _mode(folder: Path) -> None:
    (folder / "mode.json").write_text('{"form": "0", "name": "ai"}')


def _pressed(path: Path) -> None:
    """Read a remote's message, and add its path to a refusal."""
    try:
        decode(path.read_bytes())
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from None


def _released(path: Path) -> None:
    """Release a robot from the mode that a file contains."""
    answer = Answer(0, path.read_bytes().decode(errors="replace"))
    try:
        SportModeRelease(lambda *_: answer).step()
    except BackendError as error:
        raise UsageError(f"{path}: {error}") from None


def _copies(source: Path) -> Callable[[Path], object]:
    """Return a function that copies a file which spikeport ships."""
    return lambda folder: shutil.copy(source, folder / source.name)


def _report(folder: Path) -> None:
    with nengo.Network(seed=0) as network:
        nengo.Connection(nengo.Node([1]), nengo.Ensemble(10, 1))
    report = compile_network(network).report
    write_json(folder / "report.json", report.to_dict())


def _diff(path: Path) -> None:
    report = report_file.read(path)
    changes(report, report)


def _evaluation(folder: Path) -> None:
    means = {
        "speed_error_m_s": of_mean([0.1, 0.2]),
        "steps_per_s": of_mean([2.0]),
        "slip_m_s": None,
    }
    rows = [TableRow({}, 1, of_share(1, 2), means), TableRow({"push": 0.8}, 0, None, {})]
    write_evaluation(folder / "result.json", *rows, policy="mlp", network_seed=0)


def _compared(path: Path) -> None:
    if is_evaluation(path):
        compare(path, path)


def _spikes(folder: Path) -> None:
    np.savez(folder / "spikes.npz", steps=np.arange(3), sources=np.arange(3))


def _graph_spikes(folder: Path) -> None:
    np.savez(folder / "graph_spikes.npz", input=nir_graphs.spikes(6, 20))


def _spikes_of_graph(path: Path) -> None:
    spikes_of(PopulationGraph(nir_graphs.DT_S, {"input": (6,)}, {}, {}), str(path))


def _events(folder: Path) -> None:
    for suffix in ("events", "aedat"):
        write_events(folder / f"camera.{suffix}", **random_events(50, last_us=9_000))


def _notebook(folder: Path) -> None:
    sources = ["%matplotlib inline\nimport nengo\n", ["model = nengo.Network()\n", "model?"]]
    cells = [{"cell_type": "code", "source": source, "outputs": []} for source in sources]
    write_json(folder / "model.ipynb", {"nbformat": 4, "metadata": {}, "cells": cells})


def _record(folder: Path) -> None:
    clock = FakeClock()
    line, recorder = FakeLine(Board(MACHINE), clock), SessionRecorder(folder / "session.record")
    chip = BoardChip(small_image(), 0, line, recorder=recorder, clock=clock)
    for spikes in spike_train(20):
        chip.step(spikes, {})
    chip.close()


def _replay(path: Path) -> None:
    chip = ReplayChip(small_image(), 0, path)
    for spikes in spike_train(20):
        chip.step(spikes, {})
    chip.activity()


SWEEP = Sweep(
    experiment="walk",
    backend="native",
    chip="loihi",
    pipeline="compact",
    seconds=2.0,
    settings={"path": "line", "policy": "a.npz"},
    varied={"n_neurons": (2, 20)},
    seeds=(0,),
    files={"a.npz": "0f"},
)


def _plan(folder: Path) -> None:
    write_json(folder / "plan.json", asdict(SWEEP))


def _gone_on(path: Path) -> None:
    with opened(_beside(path, "sweep.json"), SWEEP):
        pass


def _point(folder: Path) -> None:
    point = SWEEP.points()[0]
    write_json(folder / "point.json", result(point, falls=0, cross_track_rms_m=0.01))


def _finished(path: Path) -> None:
    point = SWEEP.points()[0]
    SweepFolder(_beside(path, f"points/{point.name}.json")).read(point)


def _beside(path: Path, name: str) -> Path:
    """Copy a file to a name in a folder called after the file, and return the folder."""
    folder = Path(f"{path}-folder")
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(path, folder / name)
    return folder


def _frames(folder: Path) -> None:
    image = small_image()
    body, flags = Codec(image).pack_step(spike_train(1)[0], {})
    frames = [
        Frame(Kind.HELLO, body=Hello(image.digest, 0).pack()),
        *pieces(Kind.IMAGE, image.to_bytes(), 0),
        Frame(Kind.STEP, 1, 1, body, flags),
        Frame(Kind.ASK_TOTALS, 1, 1),
    ]
    (folder / "session.frames").write_bytes(b"".join(frame.encode() for frame in frames))


def _answered(path: Path) -> None:
    """Let a board answer all frames; the session's number is not known when they are written."""
    board, splitter = Board(MACHINE), Splitter()
    splitter.feed(path.read_bytes())
    while (frame := splitter.next()) is not None:
        number = 0 if board.session is None else board.session.number
        _check_answers(path, board, frame._replace(session=number))
    if splitter.bad:
        raise UsageError(f"{path}: {splitter.bad} frames skipped")


def _check_answers(path: Path, board: Board, frame: Frame) -> None:
    for answer in board.answer(frame):
        if answer.kind == Kind.REFUSAL:
            raise UsageError(f"{path}: {answer.body.decode()}")


def _bodies(folder: Path) -> None:
    image = small_image()
    body, flags = Codec(image).pack_step(spike_train(1)[0], {})
    (folder / "hello.body").write_bytes(bytes([Kind.HELLO, 0]) + Hello(image.digest, 0).pack())
    (folder / "step.body").write_bytes(bytes([Kind.STEP, flags]) + body)
    (folder / "image.body").write_bytes(bytes([Kind.IMAGE, 0]) + image.to_bytes())


def _answered_whole(path: Path) -> None:
    """Let a board in a session answer a spoilt body with a valid CRC."""
    image, (kind, flags, *_) = small_image(), (*path.read_bytes()[:2], 0, 0)
    board = Board(MACHINE)
    opening = [Frame(Kind.HELLO, body=Hello(image.digest, 0).pack())]
    if kind != Kind.IMAGE:
        opening += pieces(Kind.IMAGE, image.to_bytes(), 0)
    for frame in opening:
        board.answer(frame)
    number, step = (0, 0) if board.session is None else (board.session.number, 1)
    _check_answers(path, board, Frame(kind, number, step, path.read_bytes()[2:], flags))


def _answers(folder: Path) -> None:
    for step in (1, 300):
        packets = np.arange(step, step + 128, dtype=np.int32)
        (folder / f"step-{step}.answer").write_bytes(packets.tobytes())


def _received(path: Path) -> None:
    """Receive an answer of a board's host, which hangs up after it."""
    ours, theirs = socket.socketpair()
    with ours:
        with theirs:
            theirs.sendall(path.read_bytes()[:4096])
        try:
            recv_bytes(SimpleNamespace(socket=ours, recv_retries=1, recv_timeout=1.0), 512)
        except BackendError as error:
            raise UsageError(f"{path}: {error}") from None


LISTED = [Output(held, 0, place) for held in (Held.U, Held.V, Held.SPIKE) for place in range(9)]


def _sealed_answer(content: bytes) -> bytes:
    """Return content as an answer of a soft core's port to a host that sent nothing."""
    return content + binascii.crc_hqx(content, 0).to_bytes(port.CRC_BYTES, "big")


def _port_answers(folder: Path) -> None:
    content = np.arange(port.answer_bytes(LISTED) - port.CRC_BYTES, dtype=np.uint8)
    for name, octets in (("low", content), ("high", 255 - content)):
        (folder / f"{name}.port").write_bytes(_sealed_answer(octets.tobytes()))


def _port_read(path: Path, received: bytes) -> None:
    try:
        port.answered(b"", received, LISTED)
    except BackendError as error:
        raise UsageError(f"{path}: {error}") from None


REST = MotorCommands(*np.zeros((5, 19)))
READINGS = Sensors(0.0, np.array([1.0, 0, 0, 0]), *np.zeros((2, 3)), *np.zeros((3, 19)))


def _robot_messages(folder: Path) -> None:
    (folder / "a.lowcmd").write_bytes(encode_command(Command(5, REST)))
    (folder / "a.lowstate").write_bytes(encode_state(5, READINGS))
    (folder / "a.request").write_bytes(encode_request(Request(7, CHECK_MODE, EMPTY)))
    (folder / "a.response").write_bytes(encode_response(Response(7, CHECK_MODE, 0, EMPTY)))
    (folder / "a.sportmodestate").write_bytes(encode_base(Base(5, *np.zeros((2, 3)))))


def _read_message(path: Path, message: bytes) -> None:
    """Read a message as its receiver does; a robot obeys a command for a step."""
    try:
        if path.suffix == ".lowstate":
            decode_state(message)
        elif path.suffix == ".request":
            decode_request(message)
        elif path.suffix == ".response":
            decode_response(message)
        elif path.suffix == ".sportmodestate":
            decode_base(message)
        else:
            check_commands(decode_command(message).motors)
            robot = SimulatedRobot(RobotSettings(hoist=True))
            robot.obey(Command(robot.tick, decode_command(message).motors))
            robot.step()
    except MessageError as error:
        raise UsageError(f"{path}: {error}") from None


def _sealed_anew(path: Path) -> None:
    """Read a spoilt message with a valid checksum."""
    message = path.read_bytes()
    layout = {".lowcmd": COMMAND, ".lowstate": STATE}.get(path.suffix)
    if layout is not None and len(message) == layout.size:
        message = layout.sealed(np.frombuffer(message, "<u4").copy())
    _read_message(path, message)


def _nir(folder: Path) -> None:
    for name, graph in (("recurrent", nir_graphs.recurrent()), ("nested", nir_graphs.nested())):
        nir_graphs.written(folder, graph, f"{name}.nir")


def _entry(folder: Path) -> None:
    arrays = {"decoders": np.arange(6.0).reshape(2, 3), "digest": np.array("abc")}
    cache.Cache(folder).kept("policy", "inputs", lambda: arrays)


def _kept(path: Path) -> dict[str, np.ndarray]:
    key = digest_of(("policy", "inputs", cache.surroundings()))
    try:
        return cache.read(path, key)
    except MismatchError as error:
        raise UsageError(f"{path}: {error}") from None


def _compile_request() -> CompileRequest:
    with nengo.Network(seed=0) as network:
        ensemble = nengo.Ensemble(10, 1)
        nengo.Connection(nengo.Node(np.sin), ensemble)
        nengo.Probe(ensemble, synapse=0.01)
    return CompileRequest(network, chips.get("loihi"), 0.001, parse(""), AS_USUAL, offload=False)


def _compiled_arrays(folder: Path) -> None:
    request = _compile_request()
    compilation = compile_network(request.network, pipeline="")
    np.savez(folder / "compile.npz", **kept.arrays_of(compilation, request.network))


def _kept_compile(path: Path) -> None:
    """Read a spoilt compile as if its seal were valid."""
    try:
        kept.read(npz.read(path), _compile_request(), lambda: pytest.fail("compiled"))
    except MismatchError as error:
        raise UsageError(f"{path}: {error}") from None


LOADERS = {
    "npz": Loader(_npz, walking_policy.load),
    "TorchScript": Loader(_torchscript, load_mlp),
    "checkpoint": Loader(_checkpoint, load_mlp),
    "training": Loader(_training, training.load),
    "ONNX": Loader(_onnx, load_mlp),
    "description": Loader(_description, described),
    "image": Loader(_image, ChipImage.load),
    "calibration": Loader(_calibration, lambda path: calibration.load(path, MADE_FOR, SHAPES)),
    "observations": Loader(_observations, lambda path: read_observations(path, 3)),
    "notebook": Loader(_notebook, read_notebook),
    "remote": Loader(_remote, _pressed),
    "sport mode": Loader(_mode, _released),
    "path": Loader(_path, lambda path: read_path(path, 5.0)),
    "sweep's plan": Loader(_plan, _gone_on),
    "sweep's point": Loader(_point, _finished),
    "schedule": Loader(_copies(SCHEDULE), lambda path: schedule.load(path, 26.0)),
    "chip": Loader(_copies(BUILT_IN / "loihi.toml"), lambda path: chips.get(str(path))),
    "report": Loader(_report, _diff),
    "evaluation": Loader(_evaluation, _compared),
    "events": Loader(_events, lambda path: event_steps(process_of(path), 0.001)),
    "NIR": Loader(_nir, lambda path: nir.load(path, nir_graphs.DT_S)),
    "run": Loader(_run, _viewed),
    "spikes": Loader(_spikes, lambda path: by_step(good(), path, 5)),
    "spikes of a graph": Loader(_graph_spikes, _spikes_of_graph),
    "record": Loader(_record, _replay),
    "frames": Loader(_frames, _answered),
    "bodies": Loader(_bodies, _answered_whole),
    "answers": Loader(_answers, _received),
    "port answers": Loader(_port_answers, lambda p: _port_read(p, p.read_bytes())),
    "port answers, sealed": Loader(
        _port_answers, lambda p: _port_read(p, _sealed_answer(p.read_bytes()[: -port.CRC_BYTES]))
    ),
    "cache": Loader(_entry, _kept),
    "kept compile": Loader(_compiled_arrays, _kept_compile),
    "robot messages": Loader(_robot_messages, lambda p: _read_message(p, p.read_bytes())),
    "robot messages, sealed": Loader(_robot_messages, _sealed_anew),
}
