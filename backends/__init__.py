"""Backends: machines and emulators that an image runs on."""
