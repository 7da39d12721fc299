"""Networks rewritten: equal in float, other in shape, before nengo-loihi builds them."""
