"""Training of the walking policy that becomes the locomotion network (extra ``train``)."""
