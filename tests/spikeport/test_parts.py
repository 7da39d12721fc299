"""Parts of others, in copies: views of arrays, and parts of MuJoCo's models and data."""

import mujoco
import nengo
import numpy as np
import pytest

from spikeport.fresh_copy import fresh_copy

XML = """
<mujoco>
  <worldbody>
    <body>
      <joint name="slide" type="slide"/>
      <geom size="0.1"/>
      <body>
        <joint name="hinge"/>
        <geom name="bob" size="0.1" pos="0.3 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


class Holder:
    """An object that a node calls, with the parts that it keeps."""

    def __init__(self, **kept: object) -> None:
        self.kept = kept

    def __call__(self, _t: float) -> float:
        return 0.0


def copied(**kept: object) -> dict[str, object]:
    """Return what the holder of a network's copy keeps."""
    with nengo.Network() as network:
        nengo.Node(Holder(**kept))
    return fresh_copy(network).nodes[0].output.kept


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", [np.float64, np.int32])
@pytest.mark.parametrize(
    "part",
    [
        np.s_[1:3],
        np.s_[::-1, 1],
        np.s_[:, ::2],
        np.s_[2, 3],
        np.s_[...],
        np.s_[:0],
        np.s_[np.newaxis, 1],
    ],
)
def test_a_view_is_a_view_of_the_copied_array(order: str, dtype: type, part: object) -> None:
    whole = np.array(np.arange(20).reshape(4, 5), dtype, order=order)
    view = whole[part] if np.ndim(whole[part]) else whole[2:3, 3]
    kept = copied(view=view, whole=whole)
    np.testing.assert_array_equal(kept["view"], view)
    assert kept["view"].dtype == dtype
    kept["whole"][...] += 100
    np.testing.assert_array_equal(kept["view"], view + 100)
    assert whole.max() == 19


def test_a_view_of_a_view_and_a_transpose_follow_the_copied_array() -> None:
    whole = np.arange(12.0)
    kept = copied(view=whole.reshape(3, 4)[1:].T, whole=whole)
    kept["whole"][4:] = -1
    assert (kept["view"] == -np.ones((4, 2))).all()


@pytest.mark.parametrize(
    "array",
    [
        np.array([{"a": 1}, None, "b"], dtype=object)[1:],
        np.frombuffer(b"12345678", dtype=np.int16)[1:],
        np.lib.stride_tricks.as_strided(np.arange(9.0), (3, 2), (24, 8))[1:, 1:],
        np.broadcast_to(np.arange(3.0), (2, 3))[1],
        np.arange(6).astype("M8[s]")[::2],
        np.zeros(4, [("x", float), ("n", int)])["n"],
    ],
    ids=["objects", "bytes", "gaps", "broadcast", "times", "fields"],
)
def test_unusual_arrays_keep_their_values(array: np.ndarray) -> None:
    kept = copied(array=array)["array"]
    assert kept.tolist() == array.tolist()
    assert not np.may_share_memory(kept, array)


def test_parts_of_a_simulation_follow_its_copy() -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    data = mujoco.MjData(model)
    hinge = data.joint("hinge")
    kept = copied(
        qpos=data.qpos,
        tail=data.qpos[1:],
        hinge=hinge,
        angle=hinge.qpos,
        bob=data.geom("bob"),
        opt=model.opt,
        friction=model.geom("bob").friction,
        data=data,
        model=model,
    )
    model_2, data_2 = kept["model"], kept["data"]
    data_2.qvel[:] = 1, 2
    model_2.geom_friction[:] = 0.25
    model_2.opt.timestep = 0.004
    mujoco.mj_step(model_2, data_2)
    assert data_2.time == pytest.approx(0.004)
    place, angle = data_2.qpos
    assert place != 0
    assert angle != 0
    assert kept["qpos"].tolist() == [place, angle]
    for one in (kept["tail"], kept["angle"], kept["hinge"].qpos):
        assert one.tolist() == [angle]
    assert kept["hinge"] is data_2.joint("hinge")
    assert kept["bob"].xpos.tolist() == data_2.geom_xpos[1].tolist() != [0, 0, 0]
    assert kept["opt"].timestep == 0.004
    assert kept["friction"].tolist() == [0.25] * 3
    assert (data.time, data.qpos.tolist(), model.opt.timestep) == (0, [0, 0], 0.002)


def test_parts_of_several_simulations_follow_their_own() -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    left, right = mujoco.MjData(model), mujoco.MjData(model)
    kept = copied(
        joints=[left.joint("slide"), right.joint("slide")],
        arrays=[left.qpos, right.qpos],
        both=[left, right],
    )
    for number, data in enumerate(kept["both"]):
        data.qpos[0] = number + 1
    assert [one.qpos.item() for one in kept["joints"]] == [1, 2]
    assert [one[0] for one in kept["arrays"]] == [1, 2]
