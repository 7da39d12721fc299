"""Checks of images made by hand, which keep the kernels within their arrays."""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nengo_loihi.block import SynapseConfig

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import LAYOUT
from spikeport.compile.image.validation import (
    FORMAT,
    INDEX_BITS_OF_CODE,
    LEARNING,
    WEIGHT_BITS_OF_CODE,
)
from spikeport.errors import ImageError
from tests.helpers.forging import attack, good, learning, run
from tests.helpers.images import Block, Group, Output, Parts

N_CHECKED = 1500
"""Forged images that run with numba's own checks of every index."""


@pytest.mark.parametrize("make", [good, learning])
def test_the_good_images_run(make: Callable[[], ChipImage]) -> None:
    run(make())


def test_synapse_formats_are_those_of_nengo_loihi() -> None:
    assert SynapseConfig.params == FORMAT
    assert (tuple(SynapseConfig.WEIGHT_BITS_MAP), tuple(SynapseConfig.INDEX_BITS_MAP)) == (
        WEIGHT_BITS_OF_CODE,
        INDEX_BITS_OF_CODE,
    )


def refusal(image: ChipImage) -> str:
    with pytest.raises(ImageError) as raised:
        run(image)
    return str(raised.value)


def with_array(name: str, change: Callable[[np.ndarray], Any]) -> ChipImage:
    image = good()
    array = np.array(image.arrays[name])
    changed = change(array)
    arrays = {**image.arrays, name: array if changed is None else changed}
    return ChipImage.from_arrays(image.manifest, arrays)


def put(row: int, value: int) -> Callable[[np.ndarray], None]:
    def change(array: np.ndarray) -> None:
        array[row] = value

    return change


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("bias", lambda a: a[:-1], "the shape of compartments.decay_u is (10,), not (9,)"),
        ("vth", lambda a: a[:-1], "the shape of compartments.vth is (9,), not (10,)"),
        (
            "synapse_format",
            lambda a: a[:, 1:],
            "the shape of groups.format is (2, 18), not (2, 19)",
        ),
        ("block_start", put(0, 1), "blocks.start[0] is 1, not 0"),
        ("block_start", put(1, 11), "blocks.start[2] is 10, at least 11"),
        ("block_start", put(2, 11), "blocks.start[2] is 11, not 10, all of compartments"),
        ("block_core", put(1, 10**6), "blocks.core[1] is 1000000, at most 1, one for each block"),
        ("block_core", put(0, 1), "the first core without a block is 0, of 2 cores"),
        ("decay_u", put(3, 4096), "compartments.decay_u[3] is 4096, at most 4095"),
        ("synapse_block", put(1, 2), "groups.block[1] is 2, at most 1, the last of blocks"),
        ("synapse_block", put(0, -1), "groups.block[0] is -1, at least 0"),
        ("in_axon_row", put(2, 2), "in_axons.row[2] is 2, at most 1"),
        ("in_axon_base", put(1, 4), "the farthest target of in_axons[1] is 6, at most 5"),
        ("indices", put(0, -1), "synapses.index[0] is -1, at least 0"),
        ("row_atoms", put(0, 2**31 - 1), "rows.atoms[0] is 2147483647, at most 512"),
        (
            "row_atoms",
            put(0, 4),
            "rows.atoms[0] is 4, no divisor of the row's number of weights, 6",
        ),
        ("route_source", put(2, 1), "routes.source[2] is 1, at most 0"),
        ("route_source", put(0, 1), "the length of routes[0] is 4, not that of its source, 6"),
        ("route_synapse", put(0, 2), "routes.group[0] is 2, at most 1, the last of groups"),
        ("route_axon", put(0, 3), "out_axons.axon[0] is 3, at most 2"),
        ("route_atom", put(1, 2), "out_axons.atom[1] is 2, at most 1"),
        ("input_size", put(0, 4), "the length of routes[2] is 3, not that of its source, 4"),
        (
            "output_compartment",
            put(0, 10**9),
            "reads.compartment[0] is 1000000000, at most 9, the last of compartments",
        ),
    ],
)
def test_a_refusal_names_the_number_out_of_bounds(
    name: str, change: Callable[[np.ndarray], Any], message: str
) -> None:
    assert refusal(with_array(name, change)) == f"{message}; compile it again"


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("dt_s", 0.0, "manifest.dt_s is 0.0, not a positive number"),
        ("dt_s", float("nan"), "manifest.dt_s is nan, not a positive number"),
        ("blocks", (), "the number of manifest.blocks is 0, not 2, as in the table"),
        ("weight_bits", (8,), "manifest.weight_bits is (8,), not (0, 1, 2, 3, 4, 5, 6, 8)"),
        ("index_bits", (), "manifest.index_bits is (), not (0, 6, 7, 8, 9, 10, 11, 12)"),
        ("learning", LEARNING[::-1], f"manifest.learning is {LEARNING[::-1]}, not {LEARNING}"),
    ],
)
def test_a_manifest_that_does_not_fit_is_refused(field: str, value: object, message: str) -> None:
    image = good()
    odd = replace(image, manifest=replace(image.manifest, **{field: value}))
    assert refusal(odd) == f"{message}; compile it again"


def learns(**changed: float) -> ChipImage:
    """Return the image that learns, with other numbers in the row of its learning group."""
    image = learning()
    numbers = {name: np.array(getattr(image.groups, name)) for name in ("learning", "format")}
    for name, value in changed.items():
        table, columns = ("learning", LEARNING) if name in LEARNING else ("format", FORMAT)
        numbers[table][0, columns.index(name)] = value
    return replace(image, groups=replace(image.groups, **numbers))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (
            {"lr_int": 2.0**31},
            "the largest number of groups.learning[0] is 2147483648.0, not finit",
        ),
        ({"lr_exp": -1e300}, "the largest number of groups.learning[0] is 1e+300, not finite and"),
        (
            {"tracing_mag": np.nan},
            "the largest number of groups.learning[0] is nan, not finite and",
        ),
        ({"learn_epoch": 0}, "the learning groups' learn_epoch[0] is 0.0, at least 1"),
        ({"weight_exp": 64}, "the learning groups' weight_exp[0] is 64, not from -63 to 63"),
        ({"weight_exp": -(2**31)}, "the learning groups' weight_exp[0] is -2147483648, not from"),
    ],
)
def test_numbers_that_learning_cannot_compute_with_are_refused(
    changed: dict[str, float], message: str
) -> None:
    assert refusal(learns(**changed)).startswith(message)


def test_learning_rows_of_another_size_than_their_errors_are_refused() -> None:
    assert refusal(learning(n=3)) == (
        "the size of rows that learn[0] is 3, not 2; compile it again"
    )


def test_a_learning_group_without_a_row_is_refused() -> None:
    group = Group([], learning=(1, 4, -7, 10, 8.5, 2, 4))
    assert refusal(Parts([Block(2)], [group]).image()) == (
        "the learning groups' number of rows[0] is 0, at least 1; compile it again"
    )


@pytest.mark.parametrize(
    ("blocks", "message"),
    [
        ([], "the number of blocks is 0, at least 1"),
        ([Block(0)], "the size of blocks[0] is 0, at least 1"),
        ([Block(2), Block(0, core=1)], "the size of blocks[1] is 0, at least 1"),
    ],
)
def test_an_image_or_block_without_compartments_is_refused(
    blocks: list[Block], message: str
) -> None:
    assert refusal(Parts(blocks).image()) == f"{message}; compile it again"


@pytest.mark.parametrize("segments", [(), (0,), (-1, 1)])
@pytest.mark.parametrize("size", [-5, 3, 10**18])
def test_an_output_that_reads_no_compartments_is_refused(
    segments: tuple[int, ...], size: int
) -> None:
    image = Parts(outputs=[Output("voltage", [], decoded=True)]).image()
    entry = replace(image.manifest.outputs[0], shape=(0, size), segments=segments)
    odd = replace(image, manifest=replace(image.manifest, outputs=(entry,)))
    assert refusal(odd) == (
        f"manifest.outputs[0].segments is {segments}, not 0 in sum, of one or more that are at "
        "least 1; compile it again"
    )


def test_an_output_with_a_wrong_shape_segments_or_order_is_refused() -> None:
    image = good()
    for change, message in (
        ({"shape": (3, 1)}, "manifest.outputs[0].shape is (3, 1), of 2 weights, not (2, 1)"),
        (
            {"segments": (3,)},
            "manifest.outputs[0].segments is (3,), not 2 in sum, of one or more that are at "
            "least 1",
        ),
        ({"order": (1,)}, "manifest.outputs[0].order is (1,), no order of 1 values"),
        (
            {"order": (0,)},
            "manifest.outputs[0].order is (0,), of values of a matrix, which has its own",
        ),
    ):
        first, *others = image.manifest.outputs
        outputs = (replace(first, **change), *others)
        odd = replace(image, manifest=replace(image.manifest, outputs=outputs))
        assert refusal(odd) == f"{message}; compile it again"


def test_too_many_sources_of_inputs_are_refused() -> None:
    image = good()
    routes = image.routes
    entry = replace(image.manifest.inputs[0], size=2**31 - 1)
    manifest = replace(image.manifest, inputs=(*image.manifest.inputs, entry))
    inputs = replace(image.inputs, size=np.array([3, 2**31 - 1]))
    odd = replace(image, manifest=manifest, inputs=inputs, routes=routes)
    assert refusal(odd) == "the sum of inputs.size is 2147483650, at most 1048576; compile it again"


def test_rows_that_too_many_axons_share_are_refused() -> None:
    """The image of 1 MB has 100,000 axons that each read 1,000 single targets: 10^8 runs."""
    image = good()
    n, k = 100_000, 1_000
    blocks = replace(image.blocks, start=np.array([0, 4, 2 * k + 4]))
    more = 2 * k - 6
    odd = replace(
        image,
        blocks=blocks,
        compartments=type(image.compartments)(
            **{
                name: np.concatenate([getattr(image.compartments, name), np.zeros(more)])
                for name in type(image.compartments).columns()
            }
        ),
        groups=replace(image.groups, axon_start=np.array([0, n, n]), row_start=np.array([0, 1, 1])),
        in_axons=type(image.in_axons)(row=np.zeros(n), base=np.zeros(n)),
        rows=type(image.rows)(atoms=np.array([1]), start=np.array([0, k])),
        synapses=type(image.synapses)(weight=np.full(k, 64), index=2 * np.arange(k)),
        routes=type(image.routes)(
            **{name: np.zeros(int(name == "start")) for name in type(image.routes).columns()}
        ),
        out_axons=type(image.out_axons)(axon=np.zeros(0), atom=np.zeros(0)),
    )
    assert refusal(odd) == (
        "its axons read 100,100,000 runs of weights, limit 4,194,304 for an image of 101,000 axons "
        "and weights: rows are shared out of all proportion; compile it again"
    )


def test_a_scalar_in_place_of_a_column_is_refused() -> None:
    with pytest.raises(ImageError) as raised:
        with_array("bias", lambda a: a[0])
    assert str(raised.value) == "compartments.bias is an array of 0 dimensions, not 1"


@pytest.mark.parametrize("name", LAYOUT)
def test_a_column_of_text_is_refused(name: str) -> None:
    with pytest.raises(ImageError) as raised:
        with_array(name, lambda a: np.full(a.shape, "x"))
    assert str(raised.value).endswith("values of type <U1 are no numbers")


@pytest.mark.slow
def test_forged_images_are_refused_or_run() -> None:
    refused, ran = attack(range(400))
    assert refused > 200
    assert ran > 20


@pytest.mark.slow
def test_forged_images_stay_within_their_arrays(root: Path, tmp_path: Path) -> None:
    """Numba checks every index here: an index out of bounds would raise an IndexError.

    The code is not optimised: to compile it takes longer than to run it.
    """
    seeds = range(1000, 1000 + N_CHECKED)
    program = f"from tests.helpers.forging import attack; print(attack({seeds}))"
    numba = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_OPT": "0", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=root,
        env={**os.environ, **numba},
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    refused, ran = eval(done.stdout)
    assert refused + ran == N_CHECKED
    assert ran > 100


def test_a_forged_file_is_refused_when_it_is_loaded(tmp_path: Path) -> None:
    image = with_array("output_compartment", put(0, 10**9))
    image.save(tmp_path / "image")
    with pytest.raises(ImageError) as raised:
        ChipImage.load(tmp_path / "image")
    assert str(raised.value).startswith(f"{tmp_path / 'image'}: reads.compartment[0] is 1000000000")
