import numpy as np

from spikeport.node_functions import Held


def test_a_held_function_is_computed_only_if_its_input_changes() -> None:
    calls = []

    def double(values: np.ndarray) -> np.ndarray:
        calls.append(values.tolist())
        return 2 * values

    held, values = Held(double), np.array([1.0, 2.0])
    assert [held(t, values).tolist() for t in range(3)] == [[2.0, 4.0]] * 3
    values[0] = 3.0
    assert held(3, values).tolist() == [6.0, 4.0]
    assert calls == [[1.0, 2.0], [3.0, 2.0]]
