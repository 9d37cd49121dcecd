"""`python -m bench._readers PORT COUNT`: opens streams of a status page, of which every second one is read."""

import select
import socket
import sys

port, count = map(int, sys.argv[1:])
streams = [socket.create_connection(("127.0.0.1", port)) for _ in range(count)]
for stream in streams:
    stream.sendall(b"GET /feed HTTP/1.1\r\nHost: localhost\r\n\r\n")
print("reading", flush=True)
read = streams[::2]
while read:
    for ready in select.select(read, [], [])[0]:
        if not ready.recv(1 << 16):
            read.remove(ready)
