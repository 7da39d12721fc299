"""Backends: machines and emulators that an image runs on.

In reading order: `chip` and `execution` are the protocols of a chip and of a running network, and
`registry` lists the backends. `host_loop` runs a network in lock-step with a chip: `host_program`
is the part of it on the host, `tape` makes that part fast, and `decoding` reads the chip's outputs.
`native` and `nengo_loihi` are chips in software, `board` is a chip at the end of a link, and
`replay` a record of one. `counter` and `step_log` count what a chip does, `kept` caches compiles.
"""
