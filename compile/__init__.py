"""The compiler, from a Nengo network to a chip image.

`pipeline` drives a compile, and is the place to begin. `ground` has what all folders need to know
of a network, and `image` is the product. `rewriting` and `loihi` make blocks of a network,
`placing` finds cores for them, and `passes` are the named steps that users choose. `check` refuses
networks and gives hints, `report` sums up.
"""
