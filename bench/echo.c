/* The least that an answer over UDP costs: a blocking echo, `echo ANSWER_BYTES`, that prints its port and answers each
 * datagram with the first ANSWER_BYTES of it, zeros where it is shorter. */
#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>

int main(int argc, char **argv)
{
    static char data[2048];
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof here;
    size_t answer = argc == 2 ? strtoul(argv[1], NULL, 10) : 0;
    int end = socket(AF_INET, SOCK_DGRAM, 0);

    if (answer == 0 || answer > sizeof data || end < 0)
        return 2;
    if (bind(end, (struct sockaddr *)&here, sizeof here) || getsockname(end, (struct sockaddr *)&here, &size))
        return 1;
    printf("%d\n", ntohs(here.sin_port));
    fflush(stdout);
    for (;;) {
        struct sockaddr_in peer;
        size = sizeof peer;
        if (recvfrom(end, data, sizeof data, 0, (struct sockaddr *)&peer, &size) < 0)
            return 1;
        sendto(end, data, answer, 0, (struct sockaddr *)&peer, size);
    }
}
