"""What a running daemon shows: a terminal and a status page, each a process of its own behind a pipe with drops."""
