"""Terrain: texts that name it, and heights that agree with MuJoCo's collisions."""

import mujoco
import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.robot.description import specified
from spikeport.robot.terrain import REACH_M, Slope, Uneven, check_reach, find_terrain

EXPECTED = (
    "unknown terrain; expected flat, slope:DEGREES, slope:DEGREES:SIDE, boxes:M or relief:M, "
    "such as boxes:0.01"
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hills", EXPECTED),
        ("boxes", EXPECTED),
        ("boxes:-1", "-1 m, must be above 0; cure: flat"),
        ("relief:0", "0 m, must be above 0; cure: flat"),
        ("slope:nan", EXPECTED),
        ("relief:a", EXPECTED),
        ("flat:1", EXPECTED),
        ("slope:40", "40 degrees, limit 30 degrees"),
        ("boxes:1", "1 m, limit 0.3 m"),
    ],
)
def test_a_text_that_names_no_terrain_is_refused(text, message):
    with pytest.raises(UsageError) as caught:
        find_terrain(text)
    assert str(caught.value) == f"terrain={text}: {message}"


def test_a_text_is_parsed_into_its_terrain():
    assert find_terrain("flat") == Slope()
    assert find_terrain("slope:6:90") == Slope(np.radians(6), np.pi / 2)
    assert find_terrain("relief:0.02") == Uneven(0.02, smooth=True)


def hits(model, data, x, y):
    """Return heights at which rays from above meet the floor."""
    geom, world = np.zeros(1, dtype=np.int32), np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)
    down = np.array([0.0, 0.0, -1.0])
    distances = [
        mujoco.mj_ray(model, data, np.array([*place, 2.0]), down, world, 1, 1, geom)
        for place in zip(x, y, strict=True)
    ]
    return 2.0 - np.array(distances)


@pytest.mark.parametrize("text", ["slope:6:90", "slope:-3", "boxes:0.05", "relief:0.05"])
def test_heights_agree_with_the_floor_of_the_model(text):
    terrain, spec = find_terrain(text), specified()
    terrain.lay(spec)
    for geom in spec.geoms:  # nothing but the floor is in the way of rays
        geom.group = 0 if geom.contype else 3
    model = spec.compile()
    laid = terrain.begin(model, np.random.RandomState(3))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    x, y = np.random.RandomState(0).uniform(-4, 4, (2, 20))
    # MuJoCo makes two triangles of each cell of a relief, which differ from the interpolation
    np.testing.assert_allclose(laid.height_m(x, y), hits(model, data, x, y), atol=0.002)
    if text[0] in "br":
        assert 0 <= laid.height_m(x, y).min() < laid.height_m(x, y).max() <= 0.05
        assert laid.height_m(np.array([30.0]), np.array([0.0])) == 0


def test_a_way_beyond_the_edge_of_an_uneven_floor_is_refused():
    """The robot would walk on flat ground from there on."""
    for text in ("flat", "slope:6"):
        check_reach(text, 1000.0)
    check_reach("boxes:0.01", REACH_M)
    expected = (
        "terrain=boxes:0.01: an uneven floor goes on for 7.76 m from a start, and this robot would "
        "leave it, up to 20.00 m away; cure: a closed path, or a shorter one"
    )
    with pytest.raises(UsageError) as caught:
        check_reach("boxes:0.01", 20.0)
    assert str(caught.value) == expected


def test_an_uneven_floor_goes_on_up_to_its_reach_from_every_start():
    terrain, spec = find_terrain("boxes:0.01"), specified()
    terrain.lay(spec)
    model, turn = spec.compile(), np.linspace(0, 2 * np.pi, 24)
    for seed in range(40):
        pose = terrain.begin(model, np.random.RandomState(seed)).pose
        inside = pose.inside(REACH_M * np.cos(turn), REACH_M * np.sin(turn))
        assert np.abs(inside).max() <= 12.0
