"""`Place`: cores are placed so that messages have short paths and no link carries too many."""

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.traffic import core_messages
from spikeport.compile.passes.place import Place
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.links import Links
from spikeport.hardware_models.topology import hops, messages_between_chips
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.same_run import assert_same_run, context, small_chip


def carrying(messages: np.ndarray) -> ChipImage:
    """Return blocks on a core each; block i sends ``messages[i, j]`` messages to block j."""
    ways = list(zip(*np.nonzero(messages), strict=True))
    groups = [Group([[64]] * messages[i, j], block=j) for i, j in ways]
    routes = [Route(range(messages[i, j]), block=i, group=k) for k, (i, j) in enumerate(ways)]
    most = messages.max()
    parts = [Block(most, core=k, bias=9_000, vth=2**16) for k in range(len(messages))]
    return Parts(parts, groups, routes=routes).image()


def ring(n: int, stride: int) -> ChipImage:
    """Return n blocks on a core each; block k sends two messages to block k + stride mod n."""
    return carrying(2 * np.roll(np.eye(n, dtype=int), stride, axis=1))


def test_messages_are_counted_from_core_to_core() -> None:
    messages = core_messages(ring(4, 1))
    assert messages.tolist() == [[0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 2], [2, 0, 0, 0]]
    together = ring(4, 1).on_cores(np.array([0, 1, 1, 0]))
    assert core_messages(together).tolist() == [[2, 2], [2, 2]]


def test_placing_shortens_paths_and_relieves_the_worst_link() -> None:
    image, chip, notes = ring(16, 5), chips.get("loihi"), {}
    after = Place().apply(image, context(chip, notes))
    assert_same_run(image, after)
    placed = core_messages(after)
    assert notes["hops"] == {
        "before": int(sum(d.sum() for d in hops(core_messages(image), chip))),
        "after": int(sum(d.sum() for d in hops(placed, chip))),
    }
    # A ring over four tiles in a row leaves each tile once: three hops there, and three back.
    assert notes["hops"]["after"] == 2 * (3 + 3)
    source, target = np.nonzero(placed)
    cost = Links(16, chip).cost(source, target, placed[source, target])
    assert notes["worst_link"]["after"] == cost.worst_link == 2
    assert notes["worst_link"]["before"] > 2


def test_swaps_that_load_the_worst_link_more_are_not_kept() -> None:
    messages = np.diag([2, 4, 1, 3, 3, 1, 4], k=1)
    messages[[0, 2, 2, 4, 6, 7], [7, 0, 1, 2, 2, 1]] = [1, 1, 1, 1, 1, 2]
    # Swaps that save hops, from either start, end with 5 messages over one link.
    (source, target), swapped = np.nonzero(messages), np.array([6, 1, 0, 7, 4, 5, 2, 3])
    links = Links(8, chips.get("loihi"))
    cost = links.cost(swapped[source], swapped[target], messages[source, target])
    assert (cost.worst_link, cost.hops) == (5, 7)
    notes: dict[str, dict[str, int]] = {}
    Place().apply(carrying(messages), context(note=notes))
    assert notes["worst_link"] == {"before": 4, "after": 4}
    assert notes["hops"] == {"before": 8, "after": 8}


def test_messages_within_a_core_do_not_affect_placing() -> None:
    rng = np.random.RandomState(0)
    messages = rng.randint(1, 4, (16, 16)) * (rng.rand(16, 16) < 0.2)
    notes: list[dict[str, dict[str, int]]] = [{}, {}]
    for within, note in zip((0, 9), notes, strict=True):
        np.fill_diagonal(messages, within)
        Place().apply(carrying(messages), context(note=note))
    assert notes[0] == notes[1]
    assert notes[0]["hops"]["after"] < notes[0]["hops"]["before"]


def test_placing_removes_messages_between_chips_of_a_board() -> None:
    board = small_chip(chips=2)
    pairs = ring(256, 128)  # every message leaves its chip
    notes: dict[str, dict[str, int]] = {}
    placed = core_messages(Place().apply(pairs, context(board, notes)))
    assert notes["between_chips"] == {"before": 512, "after": 0}
    assert messages_between_chips(placed, board).sum() == 0


def test_an_image_with_too_many_cores_is_left_to_verification() -> None:
    image = ring(129, 1)
    assert Place().apply(image, context()) is image
