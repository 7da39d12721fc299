"""The paper's experiments, `arm`, `walk` and `switch`; the modules beside the folders are shared.

In reading order: `loop` joins a plant and a network, a `trial` is one run of an experiment,
`driver` does any trial, and `run_folder` writes its files. `registry` names the experiments, and
`options` has the choices that all of them share.
"""
