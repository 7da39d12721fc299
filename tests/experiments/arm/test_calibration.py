import dataclasses
import functools

import nengo
import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.experiments.arm import draw
from spikeport.experiments.arm import trial as arm_trial
from spikeport.experiments.arm.calibration import METHOD, draw_states, refit_arm
from spikeport.experiments.arm.reach import ReachSettings, ReachTrial
from spikeport.experiments.arm.reach_task import BOXES, rehearsals
from spikeport.experiments.arm.region import record_region
from spikeport.experiments.calibration import Refitted
from spikeport.experiments.driver import perform, prepare
from spikeport.experiments.options import Options
from spikeport.networks.arm import ArmSizes, arm
from spikeport.simulator import Simulator
from tests.helpers.unwritten import outcome

SMALL = ArmSizes(m1=40, cb=30, s1=10)
HOLD_S = 0.065


@pytest.fixture(scope="module")
def region(law):
    return record_region(law, rehearsals(BOXES["small"])[:1])


def held_torques(built, held):
    """Return the (n, 4) mean torque over the last 20 ms of each state, on the native chip."""
    values = np.hstack([held.state, held.target])
    with nengo.Network(seed=0) as network:
        network.add(built)
        shown = nengo.Node(nengo.processes.PresentInput(values, HOLD_S))
        nengo.Connection(shown[:11], built.state, synapse=None)
        nengo.Connection(shown[11:], built.target, synapse=None)
        probe = nengo.Probe(built.torque)
    with Simulator(network) as sim:
        sim.run(HOLD_S * len(values))
        return sim.data[probe].reshape(len(values), -1, 4)[:, -20:].mean(axis=1)


@pytest.mark.slow
def test_drawn_states_are_consistent_with_the_law_and_lie_in_the_region(law, region):
    held = draw_states(law, region, 20)
    q, dq, x = held.state[:, :4], held.state[:, 4:8], held.state[:, 8:]
    assert x == pytest.approx(law.arm.batch(q).position)
    assert sum(held.torques.values()) == pytest.approx(law.torques(q, dq, held.target - x))
    assert (np.abs(dq) <= region.dq.half).all()
    assert held.target == pytest.approx(region.x.clip(held.target))


@pytest.mark.slow
def test_refitted_decoders_bring_the_torque_nearer_to_the_exact_law(law, region):
    held = draw_states(law, region, 120)
    decoders = refit_arm(arm(law, region, SMALL), held, Options(1.0), 0.001).decoders
    assert {label: found.shape for label, found in decoders.items()} == {
        **{f"M1 {axis}": (40, 4) for axis in "xyz"},
        **{f"CB {joint}": (30, 4) for joint in ("pitch", "roll", "yaw", "elbow", "gravity")},
    }
    exact = sum(held.torques.values())
    solved, refitted = (
        np.sqrt(np.mean((held_torques(arm(law, region, SMALL, decoders=d), held) - exact) ** 2))
        for d in (None, decoders)
    )
    assert refitted < 0.95 * solved


@pytest.mark.slow
def test_a_rig_repeats_a_run_exactly_after_another_run(kept):
    settings = ReachSettings(m1=40, cb=30, s1=10)
    trials = [ReachTrial(settings, Options(0.2, seed=seed, cache=kept)) for seed in (0, 1, 0)]
    ready = prepare(trials[0])
    first, other, again = (perform(trial, ready).recording for trial in trials)
    ready.sim.close()
    assert (first.torque == again.torque).all()
    assert (first.target != other.target).any()


@pytest.fixture
def few_states(monkeypatch, region):
    """Make refits use 30 states, of one rehearsal, instead of 1,500."""
    monkeypatch.setattr(arm_trial, "record_region", lambda *_: region)
    monkeypatch.setattr(arm_trial, "draw_states", functools.partial(draw_states, n=30))


@pytest.mark.slow
def test_a_file_gives_the_controller_that_a_refit_in_place_gives(few_states, tmp_path):
    settings, options = ReachSettings(m1=40, cb=30, s1=10), Options(0.1)
    path = tmp_path / "decoders.npz"
    calibration = ReachTrial(settings, options).calibrate()
    calibration.save(path)
    digests = []
    for calibrated in (True, str(path), False):
        chosen = dataclasses.replace(settings, calibrated=calibrated)
        with prepare(ReachTrial(chosen, options)).sim as sim:
            digests.append(sim.image.digest)
    assert digests[0] == digests[1] != digests[2]
    assert calibration.image_digest not in digests  # it has no relays of decoded torques


@pytest.fixture
def no_refit(monkeypatch):
    """Leave out rehearsal and refit: the decoders are zeros."""
    monkeypatch.setattr(ReachTrial, "_rehearsed", lambda _: None)
    monkeypatch.setattr(ReachTrial, "_arm", lambda *_: None)
    monkeypatch.setattr(arm_trial, "draw_states", lambda *_: None)
    decoders = {name: np.zeros(shape) for name, shape in ReachSettings().sizes.decoders.items()}
    monkeypatch.setattr(arm_trial, "refit_arm", lambda *_: Refitted(decoders, ""))


@pytest.mark.slow
@pytest.mark.usefixtures("no_refit")
def test_a_file_made_for_another_network_is_refused(tmp_path):
    settings, options = ReachSettings(), Options(0.1)
    path = tmp_path / "decoders.npz"
    ReachTrial(settings, options).calibrate().save(path)
    other = dataclasses.replace(settings, network_seed=1, box="large", calibrated=str(path))
    with pytest.raises(UsageError) as caught:
        prepare(ReachTrial(other, options))
    assert str(caught.value) == (
        f"calibrated={path}: made for network_seed=0, box=small, but the run has network_seed=1, "
        "box=large; make it with `spikeport calibrate`, the settings of the run, and --out"
    )


@pytest.mark.slow
@pytest.mark.usefixtures("no_refit")
def test_a_file_made_by_another_method_is_refused(tmp_path, monkeypatch):
    path, settings, options = tmp_path / "decoders.npz", ReachSettings(), Options(0.1)
    ReachTrial(settings, options).calibrate().save(path)
    read = ReachTrial(dataclasses.replace(settings, calibrated=str(path)), options)
    read.check()
    monkeypatch.setattr(arm_trial, "METHOD", METHOD + 1)
    with pytest.raises(UsageError, match=f"made for method={METHOD}, but the run has method="):
        read.check()


def test_a_drawing_is_calibrated_for_its_sheet_and_time_but_not_for_its_digit():
    def depends_on(seconds=12.0, **settings):
        trial = draw.DrawTrial(draw.DrawSettings(**settings), Options(seconds))
        return trial.network_settings

    assert depends_on(digit=2) == depends_on(digit=5)
    assert depends_on(width_m=0.1) != depends_on()
    assert depends_on(seconds=20.0) != depends_on()


@pytest.mark.slow
def test_a_calibrated_controller_draws(kept, monkeypatch):
    settings = draw.DrawSettings(calibrated=True)
    region = draw.DrawTrial(settings, Options(12.0, cache=kept))._rehearsed()
    monkeypatch.setattr(draw.DrawTrial, "_rehearsed", lambda _: region)
    # A third of the states are enough to draw well; decoders made from so few must not be kept.
    monkeypatch.setattr(arm_trial, "draw_states", functools.partial(draw_states, n=500))
    metrics = outcome(draw.DrawTrial(settings, Options(12.0))).result["metrics"]
    assert metrics["shape_error_rms_m"] <= 0.003
    assert metrics["readout_spikes"] == 0
