"""``spikeport show`` and ``spikeport step``: an image by itself."""

from pathlib import Path

import nengo
import numpy as np
import pytest
from typer.testing import CliRunner

from spikeport.backends.decoding import Output
from spikeport.backends.native.chip import NativeChip
from spikeport.cli import app, main
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network
from spikeport.hardware_models.activity import PER_STEP

N_STEPS = 60


@pytest.fixture(scope="module")
def image() -> ChipImage:
    with nengo.Network(seed=3) as network:
        stimulus = nengo.Node([0.5, -0.2], label="stimulus")
        a = nengo.Ensemble(40, 2, label="a [bold]b")
        nengo.Connection(stimulus, a)
        nengo.Probe(a, synapse=0.01, label="decoded")
        nengo.Probe(a.neurons, label="spikes")
    return compile_network(network).image


@pytest.fixture
def file(image: ChipImage, tmp_path: Path) -> Path:
    image.save(tmp_path / "image.npz")
    return tmp_path / "image.npz"


def run(*arguments: object) -> str:
    done = CliRunner(env={"COLUMNS": "200"}).invoke(
        app, [str(a) for a in arguments], catch_exceptions=False
    )
    assert done.exit_code == 0
    return done.stdout


def refusal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: object
) -> str:
    monkeypatch.setattr("sys.argv", ["spikeport", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    return capsys.readouterr().err.removeprefix("error: ").rstrip("\n")


def test_show_prints_chip_digest_blocks_inputs_and_outputs(image: ChipImage, file: Path) -> None:
    lines = run("show", file).splitlines()
    assert lines[0] == f"image {image.digest}"
    assert lines[1] == "for chip loihi, computes as nengo-loihi 1.1, schema 2"
    assert lines[2].startswith(f"{image.n_compartments} compartments in 2 blocks on 1 cores, ")
    rows = [" ".join(line.split()) for line in lines]
    assert "0 0 a [bold]b ensemble 0 40" in rows
    assert any(row.startswith("0 stimulus -> a [bold]b 0 4 on/off, 500 ± 500 x Hz") for row in rows)
    assert "0 decoded voltage 4 2 Lowpass, 10 ms" in rows
    assert "1 spikes spiked 40 40 none" in rows


def test_step_writes_what_a_chip_computes(image: ChipImage, file: Path, tmp_path: Path) -> None:
    rng = np.random.RandomState(1)
    dense = rng.rand(N_STEPS, image.n_inputs) < 0.6
    steps, sources = np.nonzero(dense)
    order = rng.permutation(len(steps))  # a file need not be in order
    np.savez(tmp_path / "in.npz", steps=steps[order], sources=sources[order])
    out = tmp_path / "out.npz"
    printed = run("step", file, "--spikes", tmp_path / "in.npz", "--steps", N_STEPS, "--out", out)
    chip = NativeChip(image, seed=0)
    held = [[o.copy() for o in chip.step(np.flatnonzero(row), {})] for row in dense]
    activity = chip.activity()
    with np.load(out) as found:
        assert found["names"].tolist() == ["decoded", "spikes"]
        assert str(found["image_digest"]) == image.digest
        for number in range(2):
            expected = np.array([outputs[number] for outputs in held])
            assert np.array_equal(found[f"held_{number}"], expected)
            decoded = [Output(image, number).decode(row) for row in expected]
            assert np.array_equal(found[f"values_{number}"], decoded)
        for name in PER_STEP:
            assert np.array_equal(found[f"activity_{name}"], getattr(activity, name))
        assert found["held_1"].any()
    assert f"{N_STEPS} steps of image {image.digest[:12]}: " in printed
    assert f"written: {out}" in printed


def test_without_a_file_no_source_spikes(image: ChipImage, file: Path, tmp_path: Path) -> None:
    run("step", file, "--steps", 5, "--out", tmp_path / "out.npz")
    with np.load(tmp_path / "out.npz") as found:
        assert not found["activity_messages_host"].any()
        assert found["held_1"].shape == (5, 40)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"steps": [3], "sources": [4]}, "sources[0] is 4, but the image has 4 sources"),
        ({"steps": [9], "sources": [0]}, "steps[0] is 9, but --steps 9"),
        ({"steps": [-1], "sources": [0]}, "steps[0] is -1, but --steps 9"),
        (
            {"steps": [2, 1, 2], "sources": [3, 3, 3]},
            "source 3 spikes twice in step 2; a source spikes once in a step",
        ),
    ],
)
def test_spikes_that_cannot_be_are_refused(
    arrays: dict[str, list[int]],
    message: str,
    file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    spikes, out = tmp_path / "in.npz", tmp_path / "out.npz"
    np.savez(spikes, **{name: np.array(values) for name, values in arrays.items()})
    command = ("step", file, "--spikes", spikes, "--steps", 9, "--out", out)
    assert refusal(monkeypatch, capsys, *command) == f"{spikes}: {message}"
    assert not out.exists()


@pytest.mark.parametrize(
    "arrays",
    [{"steps": [1]}, {"steps": [1.0], "sources": [1.0]}, {"steps": [[1]], "sources": [[1]]}],
)
def test_a_file_of_another_form_is_refused(
    arrays: dict[str, object],
    file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    spikes = tmp_path / "in.npz"
    np.savez(spikes, **{name: np.array(values) for name, values in arrays.items()})
    out = tmp_path / "out.npz"
    command = ("step", file, "--spikes", spikes, "--steps", 9, "--out", out)
    message = refusal(monkeypatch, capsys, *command)
    assert message.startswith(f"{spikes}: not a file of spikes; give an npz with two arrays")
    assert not out.exists()


def test_what_is_no_image_is_refused_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("text")
    assert refusal(monkeypatch, capsys, "show", path) == (
        f"{path}: not a chip image, or truncated or altered"
    )
