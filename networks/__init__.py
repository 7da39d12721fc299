"""The spiking controllers, as plain Nengo networks with named input and output nodes.

Exact laws have a module each, and so have the networks that decode them: `operational_space` and
`arm`, `path_following` and `path_follower`. `walking_policy` is a trained network, which `policy`
converts to spikes. `action_selection` and `gating` choose among controllers, and `humanoid` has all
of them.
"""
