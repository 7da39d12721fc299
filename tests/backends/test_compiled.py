import numba
import numpy as np

from spikeport.backends.compiled import make_ready


def test_what_is_ready_is_not_compiled_again_when_it_is_called():
    called = []

    @numba.njit
    def half(values):
        with numba.objmode():
            called.append(len(values))
        return values.sum() / 2

    make_ready(half, np.zeros(0))
    ready = list(half.signatures)
    assert (len(ready), called) == (1, [])
    assert half(np.array([1.0, 2.0])) == 1.5
    assert half.signatures == ready
