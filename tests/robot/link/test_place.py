"""Places where a real robot may listen, which are refused unless allowed."""

import pytest

from spikeport.errors import UsageError
from spikeport.robot.link import place
from spikeport.robot.link.place import Place


@pytest.fixture(autouse=True)
def _interfaces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(place.socket, "if_nameindex", lambda: [(1, "lo"), (2, "eth0"), (3, 'x"')])


def test_loopback_and_the_domain_of_simulations_are_safe() -> None:
    Place().check(may_move_a_robot=False)


@pytest.mark.parametrize("where", [Place("lo", 0), Place("eth0", 1), Place("eth0", 0)])
def test_a_place_where_a_real_robot_may_move_is_refused_unless_allowed(where: Place) -> None:
    with pytest.raises(UsageError, match="a real robot may listen there, and would move"):
        where.check(may_move_a_robot=False)
    where.check(may_move_a_robot=True)


@pytest.mark.parametrize("name", ["eth9", "", 'x"', 'lo"/><'])
def test_an_unknown_interface_is_refused(name: str) -> None:
    with pytest.raises(UsageError, match="no interface"):
        Place(name).check(may_move_a_robot=True)


@pytest.mark.parametrize("domain", [-1, 231])
def test_a_domain_out_of_range_is_refused(domain: int) -> None:
    with pytest.raises(UsageError, match="must be from 0 to 230"):
        Place(domain=domain).check(may_move_a_robot=True)
