"""Plans of faults are read as they are written; those that are none are refused with the form.

What each fault does to a run is in `test_chip`.
"""

import pytest

from spikeport.backends.board.faults import KINDS, Fault
from spikeport.errors import UsageError


def test_plans_are_read() -> None:
    assert Fault.parse("loss@7") == Fault("loss", step=7)
    assert Fault.parse("slow=2.5@7") == Fault("slow", step=7, delay_s=0.0025)
    assert Fault.parse("flip:0.01") == Fault("flip", share=0.01)
    for kind in set(KINDS) - {"slow"}:
        assert Fault.parse(f"{kind}@1").kind == kind


@pytest.mark.parametrize(
    "text", ["", "loss", "loss@", "lost@7", "slow@7", "loss=3@7", "flip:1.5", "flip:.", "slow=.@1"]
)
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(
        UsageError, match=r"write KIND@STEP, slow=MS@STEP or KIND:SHARE, with a kin"
    ):
        Fault.parse(text)
