"""`python -m tests.endurance [MINUTES] [SEED]` prints docs/endurance.md with what it measured."""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.endurance.campaign import LOSS, Campaign
from tests.endurance.oracle import __doc__ as rules
from tests.endurance.processes import full_disk, killed

KILLS = 5


def main(minutes=60.0, seed=1):
    begin = time.monotonic()
    campaign = Campaign(seed).fly(60.0 * minutes)
    took = time.monotonic() - begin
    oracle, status = campaign.oracle, campaign.companion.status()
    faded_out = campaign.a_second_autopilot()
    say = print
    say("# Endurance\n")
    say(f"Printed by `python -m tests.endurance {minutes:g} {seed}`; `make proof` flies the same hour as a test.\n")
    say(
        f"{minutes:g} simulated minutes at 250 Hz, {campaign.samples} samples, computed in {took:.0f} s. "
        f"{LOSS:.0%} of the messages was lost throughout; the faults below came in turn, each when the correction was "
        "fully in again. Recovery is the simulated time from a fault's end to ACTIVE; fading in takes 0.5 s of it, "
        "measuring a link anew 2.5 s.\n"
    )
    say("| what was tried | times | recovered | recovery, median s | longest s |")
    say("| --- | --: | --: | --: | --: |")
    lost = [kind for kind, _ in campaign.unrecovered]
    for kind, times in campaign.recoveries.items():
        say(f"| {kind} | {len(times) + lost.count(kind)} | {len(times)} | {np.median(times):.2f} | {max(times):.2f} |")
    say(f"| a second autopilot on the link | 1 | stays out: {'yes' if faded_out else 'NO'} | | |")
    recoveries, missing = killed(KILLS)
    say(
        f"| kill -9 and start again (real process, wall time to the first answer) | {KILLS} | {len(recoveries)} "
        f"| {np.median(recoveries):.2f} | {max(recoveries):.2f} |"
    )
    with tempfile.TemporaryDirectory() as name:
        replay, before, unanswered, troubles = full_disk(Path(name))
    say("\n| what happened | |\n| --- | --: |")
    say(f"| messages sent, of them lost, corrupted | {campaign.sent}, {campaign.lost}, {campaign.corrupted} |")
    say(f"| corrections fresh, faded, zero | {oracle.fresh}, {oracle.faded}, {oracle.zero} |")
    say(f"| **corrections computed from bad data** | **{len(oracle.wrong)}** |")
    say(f"| times that the vehicle faded a correction by itself | {campaign.takeup.timeouts} |")
    say(f"| **corrections taken up after that, before a ramp-in from zero** | **{len(campaign.takeup.wrong)}** |")
    say(
        f"| samples bridged, gaps, late messages, malformed, foreign | {status.bridged}, {status.gaps}, {status.late}, "
        f"{status.bad}, {status.foreign} |"
    )
    say(f"| answers missing in the record after kill -9 | {missing} |")
    say(f"| full disk: samples unanswered meanwhile, words to the loop | {unanswered}, {len(troubles)} |")
    say(f"| full disk: answers before it that are not in the record | {max(0, before - replay.corrections)} |")
    say(f"| full disk: what was recorded replays | {'bit for bit' if not replay.difference else replay.difference} |")
    say("\n## How a correction is judged\n")
    say(" ".join(rules.split()))
    say(
        "\nThe oracle is `tests/endurance/oracle.py`; tests show that it finds a companion that listens to strangers, "
        "one that steps, and one altered by a hundred-thousandth. A crash would have ended the command, which catches "
        "no exception: there was none. "
        "Corrupt means a burst of up to 16 wrong bits, which the checksum always finds."
    )


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]), *map(int, sys.argv[2:3]))
