"""The least that an answer over UDP costs in Python: `python -m bench._echo ANSWER_BYTES` does what echo.c does."""

import socket
import sys


def main(answer: int) -> None:
    end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    end.bind(("127.0.0.1", 0))
    print(end.getsockname()[1], flush=True)
    while True:
        data, peer = end.recvfrom(2048)
        end.sendto(data[:answer].ljust(answer, b"\0"), peer)


if __name__ == "__main__":
    main(int(sys.argv[1]))
