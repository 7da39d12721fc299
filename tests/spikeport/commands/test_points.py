"""Workers and failures of sweeps and evaluations."""

import pytest

from spikeport.commands.options import Workers
from spikeport.commands.points import check_workers
from spikeport.errors import UsageError


def test_a_cluster_has_workers_of_its_own() -> None:
    check_workers(Workers(n=4))
    with pytest.raises(UsageError, match=r"^--workers 4: a cluster has workers of its own; "):
        check_workers(Workers(n=4, scheduler="tls://10.0.0.1:8786"))


def test_a_note_warns_of_a_cluster_without_certificates(
    capsys: pytest.CaptureFixture[str],
) -> None:
    check_workers(Workers(scheduler="tls://10.0.0.1:8786"))
    assert capsys.readouterr() == ("", "")
    check_workers(Workers(scheduler="tcp://10.0.0.1:8786"))
    assert capsys.readouterr() == (
        "",
        "note: --scheduler tcp://10.0.0.1:8786: anyone who can reach this cluster can run code "
        "on it, and on this machine as you; only the cluster's own security protects it. "
        "tls://... asks both sides for certificates.\n",
    )
