"""Trains the walking policy that the locomotion network is converted from (extra ``train``)."""
