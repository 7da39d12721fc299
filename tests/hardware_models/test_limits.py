import pytest

from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.limits import CoreUse, Usage, totals, usages

EMPTY = CoreUse("empty", 0, 0, 0, 0, 0, 0, 0)
FULL = CoreUse("full", 10, 10, 10, 640, 10, 10, 10)
OVER = CoreUse("over", 11, 10, 12, 641, 13, 10, 14)


def test_a_chip_that_is_exactly_full_exceeds_no_limit(chip):
    assert not any(usage.exceeded for usage in usages([EMPTY] * 7 + [FULL], chip))


def test_every_resource_of_every_core_is_listed(chip):
    assert [usage.resource for usage in usages([FULL], chip)] == ["cores", *CoreUse._fields[1:]]
    assert len(usages([FULL, OVER], chip)) == 1 + 2 * 7


def test_every_exceeded_limit_is_found_at_once(chip):
    cores = [EMPTY] * 7 + [FULL, OVER]
    assert [usage for usage in usages(cores, chip) if usage.exceeded] == [
        Usage("toy", "cores", 9, 8, "1"),
        Usage("over", "compartments", 11, 10, "1"),
        Usage("over", "out_axons", 12, 10, "1"),
        Usage("over", "synapse_bits", 641, 640, "bit"),
        Usage("over", "compartment_profiles", 13, 10, "1"),
        Usage("over", "synapse_profiles", 14, 10, "1"),
    ]


def test_totals_are_limited_by_all_cores_of_the_chip(chip):
    sums = totals([FULL, OVER], chip)
    assert sums["cores"] == Usage("toy", "cores", 2, 8, "1")
    assert sums["compartments"] == Usage("toy", "compartments", 21, 80, "1")
    assert sums["synapse_bits"] == Usage("toy", "synapse_bits", 1281, 5120, "bit")
    assert not any(usage.exceeded for usage in sums.values())


def test_no_cores_use_no_resources(chip):
    assert usages([], chip) == [Usage("toy", "cores", 0, 8, "1")]
    assert all(usage.used == 0 for usage in totals([], chip).values())


@pytest.mark.parametrize("n_chips", [1, 3])
def test_a_board_has_the_cores_of_all_its_chips(chip, n_chips):
    chips = chip.limits.chips.model_copy(update={"value": float(n_chips)})
    limits = chip.limits.model_copy(update={"chips": chips})
    board = chip.model_copy(update={"limits": limits})
    assert totals([FULL], board)["cores"].limit == 8 * n_chips
    assert totals([FULL], board)["in_axons"].limit == 80 * n_chips


def test_a_limit_that_is_not_public_is_never_exceeded(chip):
    limits = chip.limits.model_copy(update={"in_axons": None})
    partly = chip.model_copy(update={"limits": limits})
    assert limits.most("in_axons") == float("inf")
    found = {usage.resource: usage for usage in usages([OVER._replace(in_axons=10**9)], partly)}
    assert found["in_axons"] == Usage("over", "in_axons", 10**9, None, "1")
    assert not found["in_axons"].exceeded
    assert totals([OVER], partly)["in_axons"].limit is None


def test_soft_cores_share_blocks_of_memory():
    soft = chips.get("softcore-ecp5-85f")
    pool = soft.soft_memory
    core = EMPTY._replace(out_axons=513, synapse_bits=pool.block.count + 1)
    fixed = pool.port.count + 2 * pool.core.count
    assert totals([core, EMPTY], soft)["memory_blocks"].used == fixed + 2 + 2
    many = [core._replace(synapse_bits=100 * pool.block.count)] * 2
    found = [usage for usage in usages(many, soft) if usage.exceeded]
    assert [(usage.resource, usage.limit) for usage in found] == [
        ("synapse_bits", 1048576),
        ("synapse_bits", 1048576),
        ("memory_blocks", pool.blocks.count),
    ]


def test_each_fpga_of_a_board_has_a_port_and_blocks_of_its_own():
    soft = chips.get("softcore-ecp5-85f")
    pool, limits = soft.soft_memory, soft.limits
    two = {"chips": limits.chips.model_copy(update={"value": 2.0})}
    two["cores"] = limits.cores.model_copy(update={"value": 4.0})
    board = soft.model_copy(update={"limits": limits.model_copy(update=two)})
    core = EMPTY._replace(synapse_bits=60 * pool.block.count)
    found = [one for one in usages([core] * 4 + [EMPTY], board) if one.resource == "memory_blocks"]
    first, second = 3 + 4 * (13 + 60), 3 + 13
    assert found == [
        Usage("softcore-ecp5-85f, chip 0", "memory_blocks", first, 208, "1"),
        Usage("softcore-ecp5-85f, chip 1", "memory_blocks", second, 208, "1"),
    ]
    assert totals([core] * 4 + [EMPTY], board)["memory_blocks"][2:4] == (first + second, 416)


def test_rows_with_memory_of_their_own_take_no_memory_blocks():
    soft = chips.get("softcore-up5k")
    core = EMPTY._replace(out_axons=1000, synapse_bits=1)
    assert totals([core], soft)["memory_blocks"] == Usage(soft.name, "memory_blocks", 1, 4, "1")
