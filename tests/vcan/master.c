/* A CANopen master on SocketCAN: sets nodes up by SDO, starts them, and sends SYNC and set points.
 *
 *   master INTERFACE SECONDS PERIOD_MS NODE < SETUP
 *
 * SETUP has a line for each expedited download: node, index, sub-index, size and value, decimal.
 * NODE gets a set point with every SYNC. Prints how many frames of each identifier it has heard, a
 * line each, from the start of the nodes on. Exits 1 where an answer is missing or is an abort.
 * Sources: CiA 301, linux/can.h.
 */
#define _GNU_SOURCE
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { NMT = 0x000, SYNC = 0x080, RPDO1 = 0x200, SDO_ANSWER = 0x580, SDO_REQUEST = 0x600 };
enum { PATIENCE_MS = 60000, SET_POINT_NA = 1000000 };

static unsigned long heard[CAN_SFF_MASK + 1];

static int open_bus(const char *name)
{
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = if_nametoindex(name)};
    int bus = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    if (bus < 0 || bind(bus, (struct sockaddr *)&address, sizeof address) < 0) {
        perror(name);
        exit(1);
    }
    return bus;
}

static void transmit(int bus, canid_t id, const void *data, unsigned size)
{
    struct can_frame frame = {.can_id = id, .can_dlc = size};
    memcpy(frame.data, data, size);
    while (write(bus, &frame, sizeof frame) != sizeof frame)
        usleep(100);
}

/* Take a frame within a time; count it; return whether there was one. */
static int receive(int bus, struct can_frame *frame, long long timeout_ns)
{
    struct pollfd one = {.fd = bus, .events = POLLIN};
    struct timespec patience = {timeout_ns / 1000000000, timeout_ns % 1000000000};
    if (timeout_ns < 0 || ppoll(&one, 1, &patience, NULL) != 1 ||
        read(bus, frame, sizeof *frame) != sizeof *frame)
        return 0;
    heard[frame->can_id & CAN_SFF_MASK]++;
    return 1;
}

static int download(int bus, unsigned node, unsigned index, unsigned sub, unsigned size, unsigned value)
{
    unsigned char data[8] = {0x23 | (4 - size) << 2, index, index >> 8, sub,
                             value, value >> 8, value >> 16, value >> 24};
    struct can_frame frame;
    transmit(bus, SDO_REQUEST + node, data, 8);
    while (receive(bus, &frame, PATIENCE_MS * 1000000LL))
        if (frame.can_id == SDO_ANSWER + node)
            return frame.data[0] == 0x60 && !memcmp(frame.data + 1, data + 1, 3);
    return 0;
}

static long long now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000LL + now.tv_nsec;
}

int main(int count, char **words)
{
    unsigned node, index, sub, size, value;
    struct can_frame frame;
    if (count != 5)
        return 2;
    int bus = open_bus(words[1]);
    while (scanf("%u %u %u %u %u", &node, &index, &sub, &size, &value) == 5)
        if (!download(bus, node, index, sub, size, value)) {
            fprintf(stderr, "node %u refuses %04X:%02X\n", node, index, sub);
            return 1;
        }
    memset(heard, 0, sizeof heard);
    transmit(bus, NMT, "\x01\x00", 2);
    int set_point = SET_POINT_NA;
    long long period_ns = atoll(words[3]) * 1000000;
    long long begin = now_ns(), end = begin + atoll(words[2]) * 1000000000LL;
    for (long long next = begin; next < end; next += period_ns) {
        while (now_ns() < next)
            receive(bus, &frame, next - now_ns());
        transmit(bus, SYNC, "", 0);
        transmit(bus, RPDO1 + atoi(words[4]), &set_point, 4);
    }
    for (unsigned id = 0; id <= CAN_SFF_MASK; id++)
        if (heard[id])
            printf("%u %lu\n", id, heard[id]);
    return 0;
}
