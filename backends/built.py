"""Built parameters of a compiled network's ensembles and connections, in Nengo's units."""

import functools
from collections.abc import Mapping
from typing import Any

import nengo
from nengo.base import NengoObject
from nengo.builder.connection import BuiltConnection
from nengo.builder.ensemble import BuiltEnsemble

from spikeport.compile.ground.names import Names, base
from spikeport.compile.ground.rewrite import Built, Rewrite
from spikeport.compile.ground.scope import target_rows
from spikeport.compile.loihi.solver import CHIP, FLOAT, ParameterSolver
from spikeport.compile.pipeline import Compilation


class BuiltParameters:
    """The built parameters of the user's ensembles and connections.

    Parameters
    ----------
    compilation : Compilation
        The compiled network, with its blocks: one from a cache has to be compiled again.
    """

    def __init__(self, compilation: Compilation) -> None:
        self._compilation = compilation
        self._model = compilation.model

    def __getitem__(self, obj: NengoObject) -> Built:
        """Return the parameters of an object; see `spikeport.backends.execution.Execution.built`.

        Raises
        ------
        KeyError
            If it has none.
        """
        if isinstance(obj, nengo.Ensemble):
            return self._built_ensemble(obj)
        if isinstance(obj, nengo.Connection) and obj.solver.weights:
            return self._built_full(obj)
        if obj in self._compilation.built:
            return self._compilation.built[obj]
        model = self._model
        if obj in model.toplevel.all_connections and obj not in model.host.params:
            return self._solvers[model.split.on_chip(base(obj.pre_obj))].built(obj)
        return self._either(obj)

    def _either(self, obj: NengoObject) -> Built:
        params = self._model.params
        return params[obj] if obj in params else self._model.host.params[obj]

    def _built_ensemble(self, ensemble: nengo.Ensemble) -> BuiltEnsemble:
        for params in (self._compilation.built, self._model.params):
            if ensemble in params:
                # nengo-loihi does not divide its scaled encoders by the radius, as Nengo does.
                found = params[ensemble]
                return found._replace(scaled_encoders=found.scaled_encoders / ensemble.radius)
        return self._model.host.params[ensemble]

    def _built_full(self, connection: nengo.Connection) -> BuiltConnection:
        """Return a connection with the target's encoders included in its weights, as in Nengo."""
        found, model = self._compilation.built.get(connection), self._model
        target = base(connection.post_obj)
        if found is not None:  # passes separated encoders and decoders
            encoders = self._built_ensemble(target).scaled_encoders
            return found._replace(weights=encoders[:, target_rows(connection)] @ found.weights)
        if connection not in model.params:
            return self._either(connection)
        # nengo-loihi uses its own unit for spikes, and does not divide by the radius.
        spike = getattr(connection.pre_obj.neuron_type, "amplitude", 1) / model.dt
        full = model.params[connection]
        return full._replace(weights=full.weights / spike / target.radius)

    @functools.cached_property
    def _solvers(self) -> dict[bool, ParameterSolver]:
        """Solvers in Nengo's units of connections from the chip (True) and the host (False).

        nengo-loihi keeps connections in units of its own, and does not keep all of them.
        """
        model = self._model
        rewrite = Rewrite(model.toplevel, Names(model.toplevel), seeds=model.seeds)
        sides = {True: (CHIP, model.params), False: (FLOAT, model.host.params)}
        return {
            on_chip: ParameterSolver(rewrite, model.dt, builder, _ensembles(params))
            for on_chip, (builder, params) in sides.items()
        }


def _ensembles(params: Mapping[object, Any]) -> dict[nengo.Ensemble, BuiltEnsemble]:
    return {one: params[one] for one in params if isinstance(one, nengo.Ensemble)}
