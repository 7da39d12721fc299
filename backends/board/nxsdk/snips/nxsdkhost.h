/* The part of nxsdkhost.h that nengo-loihi's host snip uses, for the board of `snips/board.cpp`. */
#pragma once
#include <atomic>
#include <cstdint>
#include <arpa/inet.h>
#include <sys/socket.h>
class ConcurrentHostSnip {
  public:
    virtual void run(std::atomic_bool &end) = 0;
    virtual ~ConcurrentHostSnip() {}
};
void readChannel(const char *name, void *buffer, int packets);
void writeChannel(const char *name, void *buffer, int packets);
bool probeChannel(const char *name);
#define REGISTER_SNIP(Snip, Base) Base *board_host_snip() { return new Snip(); }
/* the snip listens for every machine, and ignores errors: here it listens on the loopback */
#undef INADDR_ANY
#define INADDR_ANY htonl(INADDR_LOOPBACK)
int board_bind(int socket, const sockaddr *address, socklen_t size);
int board_listen(int socket, int waiting);
#define bind board_bind
#define listen board_listen
