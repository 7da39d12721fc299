"""``spikeport step``: an image by itself, on spikes from a file."""

import numpy as np
import pytest

from spikeport.backends.decoding import Output
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.step_log import KEPT_STEPS
from spikeport.hardware_models.activity import PER_STEP

N_STEPS = 60


def test_step_writes_the_outputs_and_counts_of_a_chip(spikeport, image, image_file, tmp_path):
    rng = np.random.RandomState(1)
    dense = rng.rand(N_STEPS, image.n_inputs) < 0.6
    steps, sources = np.nonzero(dense)
    order = rng.permutation(len(steps))  # a file need not be in order
    np.savez(tmp_path / "in.npz", steps=steps[order], sources=sources[order])
    out = tmp_path / "out.npz"
    options = ("--spikes", tmp_path / "in.npz", "--steps", N_STEPS, "--out", out)
    done = spikeport("step", image_file, *options)
    assert (done.code, done.err) == (0, "")
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
    assert f"{N_STEPS} steps of image {image.digest[:12]}: " in done.out
    assert f"written: {out}" in done.out


def test_counts_cover_every_step_of_a_long_run(spikeport, image_file, tmp_path):
    out, n_steps = tmp_path / "out.npz", KEPT_STEPS + 1
    done = spikeport("step", image_file, "--steps", n_steps, "--out", out)
    assert (done.code, done.err) == (0, "")
    with np.load(out) as found:
        for name in (*PER_STEP, "host_spikes"):
            assert len(found[f"activity_{name}"]) == n_steps


def test_without_a_file_no_source_spikes(spikeport, image_file, tmp_path):
    out = tmp_path / "out.npz"
    assert spikeport("step", image_file, "--steps", 5, "--out", out).code == 0
    with np.load(out) as found:
        assert not found["activity_messages_host"].any()
        assert found["held_1"].shape == (5, 40)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        (
            {"steps": [3], "sources": [4]},
            "sources[0] is 4, but the image has 4 sources, counted from 0",
        ),
        ({"steps": [9], "sources": [0]}, "steps[0] is 9, but the run has 9 steps, counted from 0"),
        (
            {"steps": [-1], "sources": [0]},
            "steps[0] is -1, but the run has 9 steps, counted from 0",
        ),
        (
            {"steps": np.array([2**63], np.uint64), "sources": [0]},
            "steps[0] is 9223372036854775807, but the run has 9 steps, counted from 0",
        ),
        (
            {"steps": [2, 1, 2], "sources": [3, 3, 3]},
            "source 3 spikes twice in step 2; a source spikes once in a step",
        ),
    ],
)
def test_impossible_spikes_are_refused(spikeport, image_file, tmp_path, arrays, message):
    spikes, out = tmp_path / "in.npz", tmp_path / "out.npz"
    np.savez(spikes, **{name: np.array(values) for name, values in arrays.items()})
    done = spikeport("step", image_file, "--spikes", spikes, "--steps", 9, "--out", out)
    assert done == (2, "", f"error: {spikes}: {message}\n")
    assert not out.exists()


def test_step_does_not_replace_its_inputs(spikeport, image_file, tmp_path):
    spikes = tmp_path / "in.npz"
    np.savez(spikes, steps=np.array([0]), sources=np.array([0]))
    for out in (spikes, image_file):
        before = out.read_bytes()
        done = spikeport("step", image_file, "--spikes", spikes, "--steps", 9, "--out", out)
        assert done == (
            2,
            "",
            f"error: --out {out}: would replace what the command reads; choose another\n",
        )
        assert out.read_bytes() == before


@pytest.mark.parametrize(
    "arrays",
    [{"steps": [1]}, {"steps": [1.0], "sources": [1.0]}, {"steps": [[1]], "sources": [[1]]}],
)
def test_a_file_of_another_form_is_refused(spikeport, image_file, tmp_path, arrays):
    spikes = tmp_path / "in.npz"
    np.savez(spikes, **{name: np.array(values) for name, values in arrays.items()})
    out = tmp_path / "out.npz"
    done = spikeport("step", image_file, "--spikes", spikes, "--steps", 9, "--out", out)
    assert (done.code, done.out) == (2, "")
    reason = f"error: {spikes}: not a file of spikes; give an npz with two arrays"
    assert done.err.startswith(reason)
    assert not out.exists()


def test_steps_that_would_fill_the_memory_are_refused(spikeport, image, image_file, tmp_path):
    done = spikeport("step", image_file, "--steps", 10**9, "--out", tmp_path / "out.npz")
    values = sum(entry.size for entry in image.manifest.outputs) + 6 * image.n_cores
    each = 200 + 4 * len(image.reads) + 8 * values
    assert (done.code, done.out) == (2, "")
    assert done.err == (
        f"error: --steps 1000000000: the outputs and counts of these steps take "
        f"{each * 10**9:,} bytes, limit 4,294,967,296; ask for at most {2**32 // each:,} steps of "
        "this image\n"
    )
