"""Thousands of flights: `python -m sitl.campaign`.

One flight runs in one process without a socket: the companion's own core (observer, supervisor, limit and ramp) is fed
with values where the daemon feeds it with what it decoded. This package alone may import it; everything else of `sitl`
meets the companion only as bytes on a link, and one test shows that both ways give the same numbers.

::

    plan ──► Campaign: what is flown, numbered        fleet ──► local processes or a Dask cluster
               │                                        │
               ▼                                        ▼
    pilot ──► one flight, one row        store ──► Parquet, part by part        page ──► index.html
      └─ onboard: the companion's core
"""

import os

# Before numpy is loaded: flights run side by side, and their matrices are small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
