// The chip in Verilator, for backends/softcore/simulation.py: memories written, steps taken, states recorded.
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "Vchip.h"
#include "verilated.h"

namespace {

struct Simulation {
    VerilatedContext context;
    Vchip chip{&context};
    int32_t* states = nullptr;            // (compartments, 5): u, v, q, refractory, spike
    std::vector<uint32_t> first;          // compartment that each core begins with
    std::vector<uint32_t> events;         // of this step, on each core

    void settle() {
        chip.clk = 0;
        chip.eval();
    }
    void edge() {
        chip.clk = 1;
        chip.eval();
    }
    void tick() {
        settle();
        edge();
    }
};

Simulation* current = nullptr;            // the one that is evaluated, for what Verilog calls

}  // namespace

extern "C" {

void softcore_state(int core, int index, int u, int v, int q, int refractory, int spike) {
    const int32_t state[5] = {u, v, q, refractory, spike};
    std::memcpy(current->states + 5 * (current->first[core] + index), state, sizeof(state));
}

void softcore_event(int core) { ++current->events[core]; }

Simulation* softcore_open(const uint32_t* first, int cores) {
    auto simulation = std::make_unique<Simulation>();
    current = simulation.get();
    simulation->first.assign(first, first + cores);
    simulation->events.assign(cores, 0);
    simulation->chip.rst = 1;
    for (int i = 0; i < 4; ++i) simulation->tick();
    simulation->chip.rst = 0;
    simulation->tick();
    return simulation.release();
}

void softcore_close(Simulation* simulation) { delete simulation; }

// Writes n entries: core, select, address, low and high half of the data.
void softcore_write(Simulation* simulation, const uint32_t* entries, int n) {
    current = simulation;
    Vchip& chip = simulation->chip;
    chip.write = 1;
    for (int i = 0; i < n; ++i, entries += 5) {
        chip.at_core = entries[0];
        chip.select = entries[1];
        chip.at = entries[2];
        chip.in = entries[3] | static_cast<uint64_t>(entries[4]) << 32;
        simulation->tick();
    }
    chip.write = 0;
    simulation->tick();
}

// Takes a step with n messages (core, row) of the host; clear: all state becomes zero instead.
// Returns its cycles, or -1 where it does not end within `most`. counts: events of each core, then
// the messages that the bus moved.
int64_t softcore_step(Simulation* simulation, int clear, const uint32_t* messages, int n,
                      int32_t* states, uint32_t* counts, uint32_t most) {
    current = simulation;
    simulation->states = states;
    Vchip& chip = simulation->chip;
    uint32_t moved = 0;
    for (uint32_t& events : simulation->events) events = 0;
    chip.clear = clear;
    chip.go = 1;
    simulation->tick();
    chip.go = 0;
    for (uint32_t cycle = 0; cycle < most; ++cycle) {
        chip.host_valid = n > 0;
        if (n > 0) {
            chip.host_core = messages[0];
            chip.host_row = messages[1];
        }
        simulation->settle();
        moved += chip.moved;
        const bool taken = n > 0 && chip.host_ready, over = n == 0 && chip.quiet;
        simulation->edge();
        if (taken) {
            messages += 2;
            --n;
        }
        if (over) {
            std::memcpy(counts, simulation->events.data(), 4 * simulation->events.size());
            counts[simulation->events.size()] = moved;
            return chip.cycles;
        }
    }
    return -1;
}

// Reads a compartment by the chip's own port: u, v, and its spike.
void softcore_read(Simulation* simulation, int core, int index, int32_t* held) {
    current = simulation;
    Vchip& chip = simulation->chip;
    chip.at_core = core;
    chip.at = index;
    for (int i = 0; i < 3; ++i) simulation->tick();
    simulation->settle();
    held[0] = static_cast<int32_t>(chip.read_u << 8) >> 8;
    held[1] = static_cast<int32_t>(chip.read_v << 8) >> 8;
    held[2] = chip.read_spike;
}
}
