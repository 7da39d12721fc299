"""An image on compiled kernels: the bits of nengo-loihi's emulator, at the speed of the machine."""
