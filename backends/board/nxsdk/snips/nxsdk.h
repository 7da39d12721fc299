/* The part of nxsdk.h that nengo-loihi's chip snips use, for the board of `snips/board.cpp`. */
#ifndef SPIKEPORT_NXSDK_H
#define SPIKEPORT_NXSDK_H
#include <stdint.h>
#include <stdio.h>
#define CORES 160
#define COMPARTMENTS 1024
typedef struct { int time_step, total_steps; int32_t userData[8192]; } runState;
typedef struct { int id; } CoreId;
typedef struct { int32_t U, V; } CxState;
typedef struct { CxState cx_state[COMPARTMENTS]; } NeuronCore;
extern NeuronCore board_cores[CORES];
#define NEURON_PTR(core) (&board_cores[(core).id])
/* nengo-loihi's snip has a function of this name, which would hide the function of sockets */
#define shutdown nengo_io_shutdown
int getChannelID(const char *name);
void readChannel(int id, void *buffer, int packets);
void writeChannel(int id, void *buffer, int packets);
void nx_send_discrete_spike(int step, CoreId core, int axon);
void nx_send_pop16_spike(int step, CoreId core, int axon, int atom, int atom_bits);
void nx_send_pop32_spike(int step, CoreId core, int axon, int atom, int a, int b, int c);
#endif
