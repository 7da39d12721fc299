"""Resources of blocks and cores, counted by hand.

A list of n weights takes ceil((n * width + 10) / 64) words of 64 bits, where width is 8 bits for
the weight and, if the targets are not 0, 1, 2 ..., the bits of an index.
"""

from collections.abc import Callable

import nengo
import nengo_loihi
import numpy as np
import pytest

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.usage import AMOUNTS, block_amounts, core_uses
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.limits import CoreUse
from tests.helpers.images import Block, Group, Parts, Route

Make = Callable[..., nengo.Network]


LOIHI = chips.get("loihi")


def uses(network: nengo.Network) -> dict[str, CoreUse]:
    """Return the use of each block, on a core of its own."""
    image = compile_network(network, pipeline="").image
    return {core.label: core for core in core_uses(image, LOIHI)}


def test_neurons_wired_to_neurons_take_an_axon_each_at_both_ends(neuron_network: Make) -> None:
    cores = uses(neuron_network(np.ones((6, 4)), 4, 6))
    # pre: 4 neurons with an axon each. post: 4 axons of 6 weights: 6 * 8 + 10 = 58 bits, 1 word.
    assert cores["pre"] == CoreUse("pre", 4, 0, 4, 0, 1, 1, 0)
    assert cores["post"] == CoreUse("post", 6, 4, 0, 4 * 64, 1, 1, 1)


def test_only_neurons_that_are_connected_take_an_axon(neuron_network: Make) -> None:
    cores = uses(neuron_network(np.ones((6, 3)), 8, 6, slice(2, 8, 2)))
    assert (cores["pre"].out_axons, cores["post"].in_axons) == (3, 3)


@pytest.mark.parametrize(
    ("targets", "words"),
    [
        (6, 1),  # 6 * 8 + 10 = 58
        (7, 2),  # 7 * 8 + 10 = 66
        (64, 9),  # 64 * 8 + 10 = 522
        (65, 9 + 1),  # a full list, and one of 1 * 8 + 10 = 18
        (150, 9 + 9 + 3),  # two full lists, and one of 22 * 8 + 10 = 186
    ],
)
def test_lists_hold_64_weights_and_fill_whole_words(
    targets: int, words: int, neuron_network: Make
) -> None:
    cores = uses(neuron_network(np.ones((targets, 1)), 1, targets))
    assert cores["post"].synapse_bits == 64 * words


def sparse(targets: list[int]) -> nengo.Sparse:
    return nengo.Sparse((12, 1), indices=[(target, 0) for target in targets], init=1.0)


def test_scattered_targets_carry_index_bits(neuron_network: Make) -> None:
    near = uses(neuron_network(sparse([0, 1, 2, 3, 4]), 1, 12))
    far = uses(neuron_network(sparse([0, 2, 4, 6, 11]), 1, 12))
    # 5 * 8 + 10 = 50 bits; with 6 bits for indices up to 11, 5 * 14 + 10 = 80 bits.
    assert near["post"].synapse_bits == 64
    assert far["post"].synapse_bits == 128


def test_the_relay_of_a_decoded_connection_takes_a_core_of_its_own() -> None:
    with nengo.Network(seed=1) as network:
        u = nengo.Node(0.5)
        a = nengo.Ensemble(4, 1, label="a")
        b = nengo.Ensemble(6, 1, label="b")
        nengo.Connection(u, a)
        nengo.Connection(a, b)
    cores = uses(network)
    # The relay has 10 on/off pairs. It is reached by each of a's neurons with 20 weights:
    # 20 * 8 + 10 = 170 bits, 3 words. b is reached by one on and one off axon of 6 weights, which
    # the 20 relays share, and a by those of the host, of 4 weights.
    assert cores["a"] == CoreUse("a", 4, 2, 4, 2 * 64, 1, 1, 1)
    assert cores["a -> b"] == CoreUse("a -> b", 20, 4, 20, 4 * 3 * 64, 1, 1, 1)
    assert cores["b"] == CoreUse("b", 6, 2, 0, 2 * 64, 1, 1, 1)


@pytest.mark.parametrize(("pop_type", "slots"), [(32, 2), (16, 1)])
def test_a_population_axon_takes_the_slots_of_its_type(
    pop_type: int, slots: int, convolution: Make
) -> None:
    cores = uses(convolution(pop_type=pop_type, split=False))
    # 16 pixels have an axon each; all 16 are reached, as 3 x 3 filters leave no pixel out.
    assert cores["image"].out_axons == 16 * slots
    assert cores["maps"].in_axons == 16


def test_splitting_the_target_multiplies_axons(convolution: Make) -> None:
    cores = uses(convolution(split=True))
    # The maps are split into two rows of 1 x 2: the upper is reached by pixel rows 0 to 2, the
    # lower by 1 to 3, 4 pixels each, and every axon is of 2 slots.
    assert (cores["maps[1/2]"].in_axons, cores["maps[2/2]"].in_axons) == (12, 12)
    assert cores["image"].out_axons == 2 * (12 + 12)


def test_synapse_bits_of_indexed_formats_are_those_of_nengo_loihi(
    compiled_convolution: Compilation,
) -> None:
    image = compiled_convolution.image
    cores = {core.label: core for core in core_uses(image, LOIHI)}
    model = compiled_convolution.model
    expected = {
        label: sum(s.bits() for s in block.synapses)
        for label, block in zip(image.cores, model.blocks, strict=True)
    }
    assert {label: core.synapse_bits for label, core in cores.items()} == expected
    assert expected["maps[1/2]"] > 0


def test_profiles_are_distinct_settings_on_a_core(image: ChipImage) -> None:
    arrays = {name: array.copy() for name, array in image.arrays.items()}
    arrays["decay_u"][:3] += [1, 2, 2]
    arrays["decay_v"][3] += 1
    arrays["refract_delay"][4] += 1
    arrays["enable_noise"][5] = 1
    arrays["vth"][:2] += [64, 128]
    core = core_uses(ChipImage.from_arrays(image.manifest, arrays), LOIHI)[0]
    assert (core.compartment_profiles, core.threshold_profiles) == (1 + 5, 1 + 2)


def test_synapse_profiles_are_distinct_formats_on_a_core(neuron_network: Make) -> None:
    network = neuron_network(np.ones((6, 4)), 4, 6)
    with network:
        pre, post = network.ensembles
        nengo.Connection(pre.neurons, post.neurons, transform=np.ones((6, 4)), synapse=0.005)
        nengo.Connection(pre.neurons, post.neurons, transform=np.full((6, 4), 0.01), synapse=0.005)
    # The first two share a weight exponent, the third has a smaller one.
    core = uses(network)["post"]
    assert (core.in_axons, core.synapse_profiles) == (12, 2)


def test_resources_of_blocks_on_one_core_add_up(image: ChipImage) -> None:
    alone = core_uses(image, LOIHI)
    (together,) = core_uses(image.on_cores(np.zeros(image.n_blocks)), LOIHI)
    for name in ("compartments", "in_axons", "out_axons", "synapse_bits"):
        assert getattr(together, name) == sum(getattr(core, name) for core in alone)


def test_an_unconnected_ensemble_takes_no_axons_and_no_synapses() -> None:
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(5, 1, label="a")
    assert uses(network) == {"a": CoreUse("a", 5, 0, 0, 0, 1, 1, 0)}


def test_only_bits_of_weights_count_if_the_memory_layout_is_not_public(
    neuron_network: Make,
) -> None:
    image = compile_network(neuron_network(np.ones((70, 3)), 3, 70), pipeline="").image
    unknown = LOIHI.model_copy(update={"synapse_memory": None})
    assert core_uses(image, unknown)[1].synapse_bits == 70 * 3 * 8


def populations(pop_type: int = 32, blocks: int = 1, plain: bool = False) -> ChipImage:
    """Return blocks of 4 pixels of 3 channels; a pixel's channels send to one axon of a block."""
    group = Group([np.full((3, 2), 64)] * 4, block=blocks, pop_type=pop_type)
    route = {"axon": np.repeat(np.arange(4), 3), "atom": np.tile(np.arange(3), 4)}
    routes = [Route(**route, block=block) for block in range(blocks)]
    groups, more = [group], [Route([0] + [-1] * 11, group=1, block=0)] if plain else []
    if plain:
        groups.append(Group([[64]], block=blocks))
    return Parts([Block(12)] * blocks + [Block(2)], groups, routes=[*routes, *more]).image()


def out_axons(image: ChipImage) -> list[int]:
    return block_amounts(image, LOIHI)[:, AMOUNTS.index("out_axons")].tolist()


@pytest.mark.parametrize(("pop_type", "slots"), [(32, 2), (16, 1)])
def test_compartments_of_a_population_share_their_axons(pop_type: int, slots: int) -> None:
    assert out_axons(populations(pop_type)) == [4 * slots, 0]


def test_each_block_has_axons_of_its_own() -> None:
    image = populations(blocks=2)
    assert out_axons(image) == [8, 8, 0]
    assert core_uses(image.on_cores(np.zeros(3)), LOIHI)[0].out_axons == 16


def test_a_compartment_that_also_has_plain_axons_shares_no_axons() -> None:
    # Channels 1 and 2 of the first pixel share an axon; channel 0 has it again, and a plain one.
    assert out_axons(populations(plain=True)) == [4 * 2 + 2 + 1, 0]


def test_compartments_with_the_same_plain_axon_share_no_axons() -> None:
    groups = [Group([np.full((3, 2), 64)], block=1, pop_type=32), Group([[64]], block=1)]
    routes = [Route([0] * 3, atom=[0, 1, 2], block=0), Route([0] * 3, group=1, block=0)]
    assert out_axons(Parts([Block(3), Block(2)], groups, routes=routes).image()) == [3 * (2 + 1), 0]


def test_plain_axons_are_never_shared() -> None:
    assert out_axons(populations(pop_type=0)) == [12, 0]


def test_a_convolution_takes_the_axons_that_nengo_loihi_counts() -> None:
    with nengo.Network(seed=3) as network:
        nengo_loihi.add_params(network)
        transform = nengo.Convolution(6, (5, 5, 4), strides=(2, 2), kernel_size=(3, 3))
        image, maps = (
            nengo.Ensemble(n, 1, gain=np.ones(n), bias=np.zeros(n), label=label)
            for n, label in ((100, "image"), (24, "maps"))
        )
        network.config[image].block_shape = nengo_loihi.BlockShape((5, 5, 2), (5, 5, 4))
        network.config[maps].block_shape = nengo_loihi.BlockShape((2, 2, 2), (2, 2, 6))
        nengo.Connection(image.neurons, maps.neurons, transform=transform)
    compilation = compile_network(network, pipeline="")
    theirs = [block.utilization()["out-axons"][0] for block in compilation.model.blocks]
    assert out_axons(compilation.image) == theirs == [2 * 25 * 3] * 2 + [0] * 3
