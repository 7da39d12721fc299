"""Tests, each at the path of the module it is of; `helpers` has what several of them share."""
