"""Cures for refusals by nengo-loihi's builder and discretiser, by the words of the refusal."""

from spikeport.compile.ground.refusal import reason_of

ANY = "change this object"
DENSE = "use a dense transform: transform.sample(rng).toarray()"
OFF_CHIP = "do not set its on_chip: targets and error sources of learning stay on the host"
CLOSER = "bring its weights, gains and biases closer together"
SMALLER = (
    "scale down its largest weights, beside which a threshold is rounded to 0, such as its highest "
    "gains or the transform of a connection between neurons"
)
FUNCTION = "give the passthrough node a function, as in nengo.Node(lambda t, x: x, size_in=...)"
PRE_SYNAPSE = "use nengo.PES(pre_synapse=nengo.Lowpass(tau)), with a tau of one time step or more"
EVEN = (
    "give all neurons that a convolution ends at the same gain and bias: "
    "gain=nengo.dists.Choice([gain]), bias=nengo.dists.Choice([bias])"
)
CURES = {
    "Learning rule presynaptic object must be an Ensemble": (
        "learn from the ensemble in place of its neurons, as in nengo.Connection(ensemble, target, "
        "learning_rule_type=nengo.PES())"
    ),
    "Cannot handle non-Lowpass synapses": (  # SP005 names all other connections with one
        "use nengo.Lowpass on the connections through the passthrough node between these objects"
    ),
    "Loihi only supports `Lowpass` pre-synapses": PRE_SYNAPSE,
    "tracing_mag = -np.expm1(-1.0 / tracing_tau)": PRE_SYNAPSE,
    "of learned connection": OFF_CHIP,
    "of error connection": OFF_CHIP,
    "Conv2D transforms not supported for off-chip": (
        "put an ensemble on the host between them, one neuron for each value, and convolve from "
        f"its neurons; {EVEN}"
    ),
    "'Sparse' transforms": DENSE,
    "Applying a sparse transform to a decoded connection": DENSE,
    "'Convolution' transforms on chip to host": (
        "read the neurons into a node, as in nengo.Node(lambda t, x: x, size_in=...), and convolve "
        "from that"
    ),
    "assert isinstance(conn.post_obj, Ensemble)": (
        "leave weights=True out of its solver, or connect to the ensemble in place of its neurons"
    ),
    "must have the same gain": EVEN,
    "nengo-loihi only supports 2D convolution": (
        "convolve in two dimensions, one of them of size 1"
    ),
    "kernel_cols, n_channels, n_filters)": (
        "convolve with groups=1, and a kernel that is zero between the groups"
    ),
    "Non-compositional solvers only work with": "give the connection transform=1.0, which is dense",
    "'activities' matrix is all zero": (
        "lower its ensemble's intercepts, so that its neurons fire at the evaluation points"
    ),
    "cannot convert float infinity to integer": (  # the bits of an index into no weights
        "leave the connection out: none of its weights differs from 0"
    ),
    "is not probeable": "probe the ensemble or node at its end",
    "negative or non-finite gain": "raise its max_rates, or lower its intercepts below 1",
    "Max rates must be below the inverse": "lower its max_rates, or shorten its tau_ref",
    "NaNs detected in": "give every encoder a length, or set normalize_encoders=False",
    "Amplitude is not supported on RegularSpiking base types": (
        "set the amplitude of RegularSpiking itself, not that of its base type"
    ),
    "Current (U) scaling is required": "shorten the synapse's time constant below 8,192 steps",
    "Voltage (V) scaling is required": "shorten tau_rc of its neurons below 8,192 steps",
    "Could not find appropriate": CLOSER,
    "vth_to_manexp": SMALLER,
    "Mergeable transforms must be Dense": f"{DENSE} if it is sparse, else {FUNCTION}",
    "Mergeable transforms must be specified": FUNCTION,
    "cannot merge the filters": FUNCTION,
    "object selection has repeated indices": FUNCTION,
}
"""Cures for refusals, by a part of the refusal's text."""


def cure_of(error: Exception) -> str:
    """Return the cure for a refusal by nengo-loihi."""
    reason = reason_of(error)
    return next((cure for words, cure in CURES.items() if words in reason), ANY)
