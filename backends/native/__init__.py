"""An emulator in compiled kernels, equal to nengo-loihi's emulator in every bit."""
