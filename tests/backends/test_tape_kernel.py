"""Operations of a tape on one array of floats, against results by hand."""

import numpy as np
import pytest

from spikeport.backends import tape_kernel as kernel
from spikeport.backends.tape_kernel import run_tape

MEMORY = [1.0, 2.0, -3.0, 10.0, 20.0, 30.0]


def after(
    what: int, *row: int, a: float = 0.0, b: float = 0.0, tables: tuple[float, ...] = ()
) -> list[float]:
    """Return the array after one operation: n, target, stride, source, stride, table, state."""
    memory = np.array(MEMORY)
    code = np.array([[what, *row]], dtype=np.int64)
    run_tape(memory, code, np.array([[a, b]]), np.array(tables, dtype=float), 0)
    return memory.tolist()


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (after(kernel.FILL, 2, 1, 2, 1, 2, 0, 0, a=7.0), [1, 7, -3, 7, 20, 30]),
        (after(kernel.COPY, 3, 3, 1, 0, 1, 0, 0), [1, 2, -3, 1, 2, -3]),
        (after(kernel.COPY, 3, 3, 1, 0, 0, 0, 0), [1, 2, -3, 1, 1, 1]),
        (after(kernel.ADD, 3, 3, 1, 0, 1, 0, 0), [1, 2, -3, 11, 22, 27]),
        (
            after(kernel.SCALE_ADD, 2, 3, 1, 1, 1, 1, 0, tables=(9, 10, 100)),
            [1, 2, -3, 10 + 20, 20 - 300, 30],
        ),
        (
            # weights 2 and 4 of sources 2 and 0
            after(kernel.GATHER_ADD, 2, 3, 1, 0, 1, 0, 0, tables=(2, 4, 2, 0)),
            [1, 2, -3, 10 - 6, 20 + 4, 30],
        ),
        (after(kernel.GAIN, 2, 4, 1, 0, 1, 0, 0, a=0.5), [1, 2, -3, 10, 0.5, 1]),
        # the state 10 is multiplied by 0.1, the input by 2
        (after(kernel.LOWPASS, 1, 5, 1, 1, 1, 0, 3, a=0.1, b=2.0), [1, 2, -3, 5, 20, 5]),
        (after(kernel.LOWPASS_ADD, 1, 5, 1, 1, 1, 0, 3, a=0.1, b=2.0), [1, 2, -3, 5, 20, 35]),
        # voltage 10 + 2 * 0.25 = 10.5: ten spikes of 100 each
        (after(kernel.RELU, 1, 5, 1, 1, 1, 0, 3, a=100.0, b=0.25), [1, 2, -3, 0.5, 20, 1000]),
        # 3 - 2 x
        (after(kernel.AFFINE, 2, 4, 1, 1, 1, 0, 0, a=-2.0, b=3.0), [1, 2, -3, 10, -1, 9]),
        # the third step of 0.5 s
        (after(kernel.CLOCK, 1, 5, 1, 5, 1, 0, 0, a=0.5, tables=(2,)), [1, 2, -3, 10, 20, 1.5]),
        # the product that is kept for the input (2, -3)
        (
            after(kernel.PRODUCT, 1, 5, 1, 1, 1, 0, 2, tables=(1, 2, -3, 7)),
            [1, 2, -3, 10, 20, 37],
        ),
        # a negative input adds nothing
        (after(kernel.RELU, 1, 5, 1, 2, 1, 0, 0, a=100.0, b=0.25), [0, 2, -3, 10, 20, 100]),
    ],
)
def test_an_operation_computes_what_its_name_says(
    found: list[float], expected: list[float]
) -> None:
    assert found == expected


def test_operations_run_in_turn() -> None:
    memory = np.array([1.0, 0.0, 0.0])
    copy = [kernel.COPY, 1, 1, 1, 0, 1, 0, 0]
    add = [kernel.ADD, 1, 2, 1, 1, 1, 0, 0]
    run_tape(memory, np.array([copy, add, add]), np.zeros((3, 2)), np.zeros(0), 0)
    assert memory.tolist() == [1, 1, 2]


@pytest.mark.parametrize(
    ("row", "tables", "stops"),
    [
        ([kernel.CALL, 0, 0, 0, 0, 0, 0, 0], [], [True, True]),
        ([kernel.WAIT, 0, 0, 0, 0, 0, 0, 0], [1.0], [False, True]),
        ([kernel.HELD, 2, 0, 1, 0, 1, 0, 0], [0.0, 1.0, 2.0], [True, False]),
        ([kernel.HELD, 2, 0, 1, 0, 1, 0, 0], [1.0, 1.0, 2.0], [False, False]),
        ([kernel.PRODUCT, 1, 5, 1, 0, 1, 0, 2], [1.0, 1.0, 2.5, 0.0], [True, False]),
    ],
)
def test_a_tape_stops_where_python_is_needed(
    row: list[int], tables: list[float], stops: list[bool]
) -> None:
    memory, kept, end = np.array(MEMORY), np.array(tables), [kernel.FILL, 1, 5, 1, 5, 1, 0, 0]
    code, scalars = np.array([row, end]), np.zeros((2, 2))
    found = [run_tape(memory, code, scalars, kept, 0) for _ in stops]
    assert found == [0 if one else 2 for one in stops]


def test_a_tape_goes_on_after_a_stop() -> None:
    memory, call = np.array(MEMORY), [kernel.CALL, 0, 0, 0, 0, 0, 0, 0]
    code = np.array([call, [kernel.FILL, 1, 5, 1, 5, 1, 0, 0]])
    assert run_tape(memory, code, np.full((2, 2), 4.0), np.zeros(0), 1) == 2
    assert memory.tolist() == [*MEMORY[:5], 4.0]
