// Channels and registers around nengo-loihi's own snips: the part of a board outside Python.
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <vector>
extern "C" {
#include "nxsdk.h"
}
#undef shutdown
#include "nxsdkhost.h"
#undef bind
#undef listen

namespace {
const int ELEMENTS = 64;  // of a packet
struct Packet { int32_t element[ELEMENTS]; };

class Channel {
    std::mutex lock;
    std::condition_variable filled;
    std::deque<Packet> packets;

  public:
    void write(const Packet *from, int n) {
        std::lock_guard<std::mutex> held(lock);
        packets.insert(packets.end(), from, from + n);
        filled.notify_one();
    }
    void read(Packet *to, int n) {
        std::unique_lock<std::mutex> held(lock);
        for (; n > 0; n--, to++) {
            filled.wait(held, [this] { return !packets.empty(); });
            std::memcpy(to, &packets.front(), sizeof(Packet));
            packets.pop_front();
        }
    }
    bool any() {
        std::lock_guard<std::mutex> held(lock);
        return !packets.empty();
    }
};

Channel channels[2];  // from the host and to it
std::mutex naming;
std::map<std::string, int> names;

int number(const char *name) {
    std::lock_guard<std::mutex> held(naming);
    return names.emplace(name, (int)names.size()).first->second;
}

std::vector<int32_t> spikes;  // core, axon and atom of each
std::atomic_bool end(false);
std::atomic_int listening(0);  // 1: the host can connect, -1: it cannot
bool bound = false;
}  // namespace

void readChannel(const char *name, void *to, int n) { channels[number(name)].read((Packet *)to, n); }
void writeChannel(const char *name, void *from, int n) {
    channels[number(name)].write((const Packet *)from, n);
}
bool probeChannel(const char *name) { return channels[number(name)].any(); }
int board_bind(int socket, const sockaddr *address, socklen_t size) {
    int result = ::bind(socket, address, size);
    bound = result == 0;
    return result;
}
int board_listen(int socket, int waiting) {
    int result = ::listen(socket, waiting);
    listening = bound && result == 0 ? 1 : -1;
    return result;
}
ConcurrentHostSnip *board_host_snip();

extern "C" {
NeuronCore board_cores[CORES];
int guard_io(runState *);
void nengo_io(runState *);
int getChannelID(const char *name) { return number(name); }
void readChannel(int id, void *to, int n) { channels[id].read((Packet *)to, n); }
void writeChannel(int id, void *from, int n) { channels[id].write((const Packet *)from, n); }
void nx_send_discrete_spike(int, CoreId core, int axon) {
    spikes.insert(spikes.end(), {core.id, axon, 0});
}
void nx_send_pop16_spike(int, CoreId core, int axon, int atom, int) {
    spikes.insert(spikes.end(), {core.id, axon, atom});
}
void nx_send_pop32_spike(int, CoreId core, int axon, int atom, int, int, int) {
    spikes.insert(spikes.end(), {core.id, axon, atom});
}

// The host's side, in a thread of its own: waits for a connection, returns once it is shut down.
void board_host() {
    ConcurrentHostSnip *snip = board_host_snip();
    snip->run(end);
    delete snip;
}
int board_listens() { return listening; }

// The management phase of a step: registers in, spikes out. Returns their number, -1 at the end.
int board_manage(int step, int n, const int32_t *core, const int32_t *compartment,
                 const int32_t *u, const int32_t *v, int32_t *sent, int room) {
    static runState state;
    for (int i = 0; i < n; i++)
        board_cores[core[i]].cx_state[compartment[i]] = CxState{u[i], v[i]};
    state.time_step = step;
    spikes.clear();
    nengo_io(&state);
    if (!guard_io(&state)) return -1;
    int found = std::min((int)spikes.size() / 3, room);
    std::memcpy(sent, spikes.data(), found * 3 * sizeof(int32_t));
    return found;
}
}
