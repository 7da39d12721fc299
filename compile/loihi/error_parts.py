"""Errors that are sent to a part of a learning rule, as to ``learned.learning_rule[1]``.

nengo-loihi leaves the slice out: it takes the values for the whole error, in their order.
"""

import contextlib
from collections.abc import Iterator

import nengo
from nengo_loihi.builder import Model
from nengo_loihi.builder import connection as builder
from nengo_loihi.builder.inputs import HostSendNode

from spikeport.compile.ground.names import base
from spikeport.compile.loihi.replaced import replaced

WHOLE = slice(None)


@contextlib.contextmanager
def error_parts_placed() -> Iterator[None]:
    """Send errors to the parts of learning rules that they are meant for, within the context."""
    usual = builder.build_host_to_learning_rule

    def build(model: Model, connection: nengo.Connection) -> None:
        matrix = builder.is_transform_type(connection.transform, ("Dense", "NoTransform"))
        # nengo-loihi refuses other transforms.
        if connection.post_slice == WHOLE or not matrix:
            usual(model, connection)
        else:
            _build_part(model, connection)

    with replaced(builder, "build_host_to_learning_rule", build):
        yield


def _build_part(model: Model, connection: nengo.Connection) -> None:
    """Build a connection to a part of a learning rule: the rest of its error is zero."""
    host, rule = model.host_model(base(connection.pre_obj)), connection.post_obj
    send = HostSendNode(rule.size_in, label=connection.label, add_to_container=False)
    host.build(send)
    sent = nengo.Connection(
        connection.pre,
        send[connection.post_slice],
        function=connection.function_info,
        solver=connection.solver,
        eval_points=connection.eval_points,
        scale_eval_points=connection.scale_eval_points,
        synapse=connection.synapse,
        transform=connection.transform,
        label=connection.label,
        add_to_container=False,
    )
    model.host2chip_pes_senders[send] = model.needs_sender[rule]
    builder._inherit_seed(host, sent, model, connection)
    host.build(sent)
