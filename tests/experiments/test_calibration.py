"""The file that keeps refitted decoders."""

import nengo
import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.experiments.calibration import DecoderCalibration, load, play_in
from spikeport.experiments.options import Options
from tests.helpers.chip_files import chip_file

MADE_FOR = {"experiment": "reach", "m1": 40, "chip": "loihi", "passes": "by default"}
DECODERS = {"M1 x": np.arange(6.0).reshape(3, 2), "bias": np.ones(2)}
SHAPES = {name: D.shape for name, D in DECODERS.items()}
CURE = "; make it with `spikeport calibrate`, the settings of the run, and --out"


@pytest.fixture
def path(tmp_path):
    DecoderCalibration(MADE_FOR, "abc", DECODERS).save(tmp_path / "c.npz")
    return tmp_path / "c.npz"


def refusal(path, **other):
    with pytest.raises(UsageError) as caught:
        load(path, {**MADE_FOR, **other}, SHAPES)
    return str(caught.value).removesuffix(CURE).removeprefix(f"calibrated={path}: ")


def test_a_saved_calibration_is_read_back_and_leaves_no_other_file(path):
    found = load(path, MADE_FOR, SHAPES)
    assert (found.made_for, found.image_digest) == (MADE_FOR, "abc")
    assert list(found.decoders) == ["M1 x", "bias"]
    assert (found.decoders["M1 x"] == np.arange(6.0).reshape(3, 2)).all()
    assert [file.name for file in path.parent.iterdir()] == ["c.npz"]


def test_decoders_for_another_network_are_refused_with_every_difference_named(path):
    assert refusal(path, m1=50, passes="compact") == (
        "made for m1=40, passes=by default, but the run has m1=50, passes=compact"
    )
    assert len(refusal(path, box="small" * 10**6)) < 1000
    assert refusal(path, box="small") == "made for box=None, but the run has box=small"


@pytest.mark.parametrize(
    ("decoders", "found"),
    [
        ({}, "decoders M1 x: expected shape (3, 2), found none"),
        (
            {**DECODERS, "trim": np.ones(2)},
            "decoders trim: expected none, found shape (2,)",
        ),
        (
            {**DECODERS, "bias": np.array(1.0)},
            "decoders bias: expected shape (2,), found shape ()",
        ),
    ],
)
def test_decoders_that_do_not_fit_the_neurons_are_refused(path, decoders, found):
    DecoderCalibration(MADE_FOR, "", decoders).save(path)
    assert refusal(path) == found


def test_numbers_that_are_not_finite_are_refused(path):
    DecoderCalibration(MADE_FOR, "", {"D": np.array([1.0, np.nan])}).save(path)
    assert refusal(path) == "NaN or infinity in it, or no numbers"


def test_a_file_that_is_not_a_calibration_is_refused(path):
    path.write_text("text", encoding="utf-8")
    assert refusal(path) == "expected a whole zip archive, found one without a list of members"
    np.savez(path, weights=np.ones(3))
    assert refusal(path) == "no calibration in it"


def test_a_calibration_of_an_earlier_image_schema_is_refused(path):
    with np.load(path) as file:
        members = dict(file)
    del members["image_schema"]  # files of schema 1 lack this member
    np.savez(path, **members)
    assert refusal(path) == "made for image schema 1, this spikeport has 2"


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"made_for": "{"}, "no calibration in it"),
        ({"made_for": "[]"}, "no calibration in it"),
        ({"made_for": "5"}, "no calibration in it"),
        ({"made_for": "[" * 100_000}, "no calibration in it"),
        ({"image_schema": np.array([2, 2])}, "no calibration in it"),
        ({"image_schema": "2"}, "no calibration in it"),
        ({"decoders/arm": np.array(["a"])}, "NaN or infinity in it, or no numbers"),
        ({"decoders/arm": np.array([np.nan])}, "NaN or infinity in it, or no numbers"),
    ],
)
def test_a_calibration_with_malformed_content_is_refused(path, change, complaint):
    with np.load(path) as file:
        np.savez(path, **{**file, **change})
    assert refusal(path) == complaint


def test_one_flipped_byte_is_refused(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 0x10
    path.write_bytes(content)
    assert "expected a whole zip archive" in refusal(path)


def test_a_file_cut_short_is_refused(path):
    path.write_bytes(path.read_bytes()[:-40])
    assert refusal(path) == "expected a whole zip archive, found one without a list of members"


def test_a_plain_array_is_refused(path):
    with open(path, "wb") as file:
        np.save(file, np.ones(3))
    assert refusal(path) == "expected an archive of arrays (.npz), found a single array (.npy)"


def test_played_values_are_held_for_their_steps_and_the_last_one_stays():
    with nengo.Network() as network:
        node = nengo.Node(size_in=1)
        play_in(node, np.array([[1.0], [2.0]]), steps=3, dt_s=0.001)
        probe = nengo.Probe(node)
    with nengo.Simulator(network, progress_bar=False) as sim:
        sim.run_steps(8, progress_bar=False)
        assert sim.data[probe].ravel().tolist() == [1, 1, 1, 2, 2, 2, 2, 2]


def substrate(**options):
    return Options(1.0, **options).substrate


def test_backends_with_a_chip_share_calibrations_and_float_has_its_own():
    assert substrate() == {"chip": "loihi", "passes": "by default"}
    assert substrate(backend="nengo-loihi") == substrate()
    assert substrate(pipeline="compact") != substrate()
    assert substrate(backend="reference", pipeline="compact") == {"chip": "none", "passes": "none"}


def test_a_chip_from_a_file_is_identified_by_its_content_and_not_by_its_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = chip_file(tmp_path / "my.toml", cores=100)
    mine = substrate(chip="my.toml")
    assert substrate(chip="./my.toml") == substrate(chip=str(file)) == mine != substrate()
    chip_file(file, cores=99)
    assert substrate(chip="my.toml") != mine


def test_a_run_without_passes_differs_from_one_with_the_default_passes():
    assert substrate(pipeline="") != substrate()


def test_a_file_without_a_method_counts_as_made_by_method_1(path):
    load(path, {**MADE_FOR, "method": 1}, SHAPES)
    assert refusal(path, method=2) == "made for method=1, but the run has method=2"
