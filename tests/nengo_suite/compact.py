"""spikeport's simulator on networks that are rewritten first."""

from typing import Any

import nengo

import spikeport


class Compact(spikeport.Simulator):
    """With the pipeline ``compact``; for the setting ``nengo_simulator`` of Nengo's plugin."""

    def __init__(self, network: nengo.Network, *args: Any, **options: Any) -> None:
        super().__init__(network, *args, pipeline="compact", **options)
