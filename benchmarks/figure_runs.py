"""The runs that figures and pictures in the documents rest on."""

from collections.abc import Iterable

NETWORKS = "network_seed=0,1,2,3,4"
SHAPES = ("line", "s-curve", "figure-eight", "loop")
PATHS = f"path={','.join(SHAPES)}"
SIZES = (200, 500, 1000, 2000, 8000)
SECONDS = (4, 6, 8, 12, 20)
QUIET_POLICY = "build/quiet/h1_walk.npz"
"""A policy whose hidden units never had noise."""
TRAINING = (
    "(test -e build/f82d95d || git worktree add build/f82d95d f82d95d)"
    " && PYTHONPATH=build/f82d95d/src python -m spikeport train walk"
    " --seed 2 --threads 1 --steps 14745600 --no-hidden-noise --out build/quiet"
)
"""Makes that policy in 43 minutes of CPU time or so, by the stages of that commit: later ones
train another policy."""
QUIET_STAGE = "- **upright**: "
"""Begins the last stage of that policy's card, `h1_walk.md`; later commits have no such stage."""
ROBUST_POLICY = "networks/policies/h1_robust.npz"
ROBUST_ROWS = (
    *("push=0.8", "terrain=slope:6", "terrain=boxes:0.01", "terrain=boxes:0.02"),
    *("observation_delay=0.02", "estimator=leg-odometry", "robot_model=urdf"),
)
PERTURBED_ROWS = (
    *("friction=0.4", "mass=1.2", "payload=10.0", "com_y=0.03", "gains=0.8", "strength=0.5"),
    *("action_delay=0.02", "action_delay=0.03", "observation_delay=0.02", "sensor_noise=1.0"),
    *("push=0.8", "terrain=slope:6", "terrain=boxes:0.01", "terrain=relief:0.02"),
    *("estimator=leg-odometry", "robot_model=urdf"),
)
UNIT_ROWS = ("push=0.5", "terrain=boxes:0.02", "terrain=slope:6", "observation_delay=0.02")
QUIET = f"walk --set policy={QUIET_POLICY} --set path=loop --seconds 20"


def _evaluate(rows: Iterable[str], episodes: int) -> str:
    asked = " ".join(f"--row {row}" for row in rows)
    return f"evaluate walk --episodes {episodes} {asked}"


RUNS = {
    **{
        f"reach_{box}_{backend}": f"sweep reach --set box={box} --set network_seed=0 --seeds 5"
        f" --backend {backend}"
        for box in ("small", "large")
        for backend in ("analytic", "reference", "native")
    },
    **{
        f"draw_{s}s": f"sweep draw --vary digit=2,5,8 --seconds {s} --backend analytic"
        for s in SECONDS
    },
    "draw_lean": "sweep draw --vary digit=2,5,8 --vary network_seed=0,1,2",
    "draw_efference": "sweep draw --vary digit=2,5,8 --set efference_copy=true",
    "draw_sizes": f"sweep draw --vary digit=2,5,8 --vary m1={','.join(map(str, SIZES))}",
    "reach_sizes": f"sweep reach --set network_seed=0 --vary m1={','.join(map(str, SIZES))}"
    " --seeds 2",
    "arm_lean": "compile arm",
    "arm_paper": "compile arm --set preset=paper",
    "switch": f"sweep switch --vary {NETWORKS}",
    "switch_paper": "run switch --set preset=paper",
    "switch_free": "sweep switch --set schedule=free-standing --set anchor=false"
    f" --vary {NETWORKS}",
    "switch_spa": "run switch --backend reference --set selection=spa",
    "demo": "run switch",
    "walk_exact": f"sweep walk --vary {PATHS} --seeds 5 --backend analytic",
    "walk_front": "sweep walk --vary n_neurons=2,4,6,10,20 --set path=s-curve --seeds 3"
    " --seconds 40",
    "walk_20": f"sweep walk --vary {PATHS} --seeds 5 --set n_neurons=20",
    "walk_10": f"sweep walk --vary {PATHS} --seeds 5 --set n_neurons=10",
    "walk_2": "sweep walk --vary path=s-curve,loop --seeds 5 --set n_neurons=2",
    "walk_slow": "sweep walk --vary path=s-curve,loop --seeds 5 --set n_neurons=20"
    " --set tau_fwd=0.01",
    "walk_silenced": "run walk --set n_neurons=20 --set path=loop --set silence=0.5"
    " --set silence_at=25 --seconds 40",
    "perturbed_exact": f"{_evaluate(PERTURBED_ROWS, 20)} --backend analytic",
    "perturbed_4": f"{_evaluate(UNIT_ROWS, 30)} --set n_neurons=4",
    "perturbed_20": f"{_evaluate(UNIT_ROWS, 30)} --set n_neurons=20",
    "robust_exact": f"{_evaluate(ROBUST_ROWS, 200)} --backend analytic"
    f" --set policy={ROBUST_POLICY}",
    "robust_chip": f"{_evaluate(ROBUST_ROWS, 200)} --set gait=rough --set policy={ROBUST_POLICY}",
    "robust_paths_exact": f"sweep walk --vary {PATHS} --set policy={ROBUST_POLICY} --set ramp=4"
    " --seeds 3 --backend analytic",
    "robust_paths": f"sweep walk --vary {PATHS} --set policy={ROBUST_POLICY} --set gait=rough"
    " --set ramp=4 --vary network_seed=0,1,2 --seeds 1",
    "quiet_exact": f"run {QUIET} --backend analytic",
    "quiet_off": f"sweep {QUIET} --set calibrated=false --vary n_neurons=2,20"
    " --vary backend=native,reference --seeds 1",
    "quiet_on": f"sweep {QUIET} --vary n_neurons=2,20 --seeds 1",
    "walk_float": "sweep walk --backend reference --seeds 5 --seconds 20 --set path=loop"
    " --set calibrated=false --vary n_neurons=2,20",
    "simulate": "simulate examples/communication_channel.py",
    "reach": "run reach",
    "robot": "run walk --backend board --robot stub --seconds 20",
    "fig5a": "figure 5a",
    "fig5b": f"figure 5b --set policy={QUIET_POLICY}",
    "fig5c": "figure 5c",
}
"""The arguments of ``spikeport``, by name; hours in all, and each goes on where it was."""
PICTURES = {
    "simulate": "docs/simulate.png",
    "demo": "docs/switch.png",
    "reach": "docs/reach.png",
    "robot": "docs/robot.png",
    "fig5a": "docs/fig5a.png",
    "fig5b": "docs/fig5b.png",
    "fig5c": "docs/fig5c.png",
}
"""The pictures of the documents, by the run whose figure they are."""
