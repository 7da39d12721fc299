import numpy as np

from spikeport.hardware_models.links import Cost, Links


def cost(chip, *flows):
    """Return the cost of messages; cores 0, 1 | 2, 3 | 4, 5 | 6, 7 on tiles 00 | 01 | 10 | 11."""
    source, target, messages = np.array(flows).T
    return Links(8, chip).cost(source, target, messages)


def board(chip):
    two = chip.limits.chips.model_copy(update={"value": 2.0})
    return chip.model_copy(update={"limits": chip.limits.model_copy(update={"chips": two})})


def test_messages_within_a_tile_load_no_link(chip):
    assert cost(chip, (0, 1, 9), (2, 2, 9)) == Cost(0, 0, 0)


def test_messages_move_along_the_row_and_then_the_column(chip):
    # (0, 0) -> (1, 1) goes by (1, 0): it shares its first link with (0, 0) -> (1, 0) ...
    assert cost(chip, (0, 6, 5), (1, 4, 3)) == Cost(0, 8, 2 * 5 + 3)
    # ... its second with (1, 0) -> (1, 1), and none with (0, 0) -> (0, 1).
    assert cost(chip, (0, 6, 5), (4, 7, 4)) == Cost(0, 9, 2 * 5 + 4)
    assert cost(chip, (0, 6, 5), (0, 3, 4)) == Cost(0, 5, 2 * 5 + 4)


def test_a_message_loads_no_link_beyond_its_target(chip):
    tiles = {"tiles_x": 1.0, "tiles_y": 4.0}
    topology = chip.topology.model_copy(
        update={
            name: getattr(chip.topology, name).model_copy(update={"value": value})
            for name, value in tiles.items()
        }
    )
    column = chip.model_copy(update={"topology": topology})
    assert cost(column, (0, 2, 5), (4, 6, 4)) == Cost(0, 5, 5 + 4)


def test_the_two_directions_of_a_link_are_loaded_apart(chip):
    assert cost(chip, (0, 4, 5), (4, 0, 3)) == Cost(0, 5, 8)


def test_messages_between_chips_are_counted_and_not_routed(chip):
    links = Links(16, board(chip))
    source, target, messages = np.array([0, 8]), np.array([15, 12]), np.array([7, 2])
    assert links.cost(source, target, messages) == Cost(7, 2, 2)


def test_another_chip_is_further_than_any_tile(chip):
    distance = Links(16, board(chip)).distances()
    assert np.array_equal(distance, distance.T)
    assert distance[0].tolist() == [0, 0, 1, 1, 1, 1, 2, 2] + [3] * 8


def test_several_sets_of_messages_load_links_as_each_does_alone(chip):
    """Negative messages are taken away from the loads."""
    links = Links(16, board(chip))
    rng = np.random.RandomState(0)
    source, target, messages, of = (rng.randint(high, size=60) for high in (16, 16, 9, 3))
    together = links.loads(source, target, messages, of, 4)
    for one in range(4):
        mine = of == one
        n = int(mine.sum())
        alone = links.loads(source[mine], target[mine], messages[mine], np.zeros(n, int), 1)
        assert all(np.array_equal(a[one], b[0]) for a, b in zip(together, alone, strict=True))
    both = [np.tile(array, 2) for array in (source, target)]
    none = links.loads(*both, np.concatenate([messages, -messages]), np.tile(of, 2), 4)
    assert not any(array.any() for array in none)
