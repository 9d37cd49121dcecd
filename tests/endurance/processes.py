"""The real daemon, killed and started again; and a recorder whose disk is full."""

import json
import resource
import signal
import tempfile
import time
from pathlib import Path

from dob_companion.artifact import dumps
from dob_companion.files.segments import segments_in, traces_at
from tests.cli.processes import UdpVehicle, daemon, run_cli
from tests.companion.aircraft import corrections, small_design
from tests.ports import free_port
from tests.recorder.flights import pairs_in_a_hurry, recorded, replayed, wait_until


def killed(times):
    """Fly, kill -9, start again. Seconds from each new start to its first answer; answers not in the record."""
    recoveries, missing = [], 0
    with tempfile.TemporaryDirectory() as name:
        directory, port = Path(name), free_port()
        design = directory / "design.json"
        design.write_text(dumps(small_design())[0])
        began = None
        for number in range(times + 1):
            flights = directory / f"flights-{number}"
            begin = time.monotonic()
            with daemon(design, port, "--record", flights) as process, UdpVehicle(port) as vehicle:
                vehicle.fly(1)
                if began is not None:
                    recoveries.append(time.monotonic() - begin)
                began = begin
                vehicle.activate().fly(50)
                answered = vehicle.sample
                process.send_signal(signal.SIGKILL)
                process.wait()
            found = {}

            def all_there(flights=flights, found=found, answered=answered):
                found.update(json.loads(run_cli("replay", flights, "--json").stdout or "{}"))
                return found.get("corrections", 0) >= answered

            wait_until(all_there)
            missing += answered - found["corrections"] + (not found["identical"])
            assert segments_in(flights)
    return recoveries, missing


def full_disk(directory):
    """A disk that fills up in flight and has room again. Answers that replay, those in all, words to the loop, whether
    what was recorded differs from what is computed again."""
    with recorded(directory) as plane:
        plane.active()
        before = len(corrections(plane.said))
        wait_until(lambda: any(path.stat().st_size for path in traces_at(directory)))
        wait_until(lambda: replayed(*traces_at(directory))[0].corrections >= before)  # all of it is on the disk
        resource.prlimit(plane.recorder.scribe, resource.RLIMIT_FSIZE, (500, resource.RLIM_INFINITY))
        asked = 300
        answered = len(corrections(pairs_in_a_hurry(plane, asked, 0.1).said)) - before
        resource.prlimit(plane.recorder.scribe, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
        pairs_in_a_hurry(plane, 600, 0.1)
        troubles = plane.companion.troubles
    replay, _ = replayed(*traces_at(directory))
    return replay, before, asked - answered, troubles
