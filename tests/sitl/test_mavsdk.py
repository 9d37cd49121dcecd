"""A ground station that others wrote: MAVSDK connects, arms, takes off and reads attitude."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.ports import free_port

pytest.importorskip("mavsdk")

# MAVSDK in a process of its own: its native threads are no guests for a test runner.
STATION = '''
import sys, threading
from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.action import Action
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import Telemetry

station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
station.add_any_connection(sys.argv[1])
vehicle = station.first_autopilot(30.0)
telemetry, action = Telemetry(vehicle), Action(vehicle)

def until(name, holds):
    """Wait for telemetry; a subscription only tells of news, so look at what is known already, too."""
    met = threading.Event()
    handle = getattr(telemetry, "subscribe_" + name)(lambda value, _: met.set() if holds(value) else None)
    known = getattr(telemetry, name)()
    assert (known is not None and holds(known)) or met.wait(30.0), (name, known)
    getattr(telemetry, "unsubscribe_" + name)(handle)

until("health", lambda h: h.is_armable)
action.arm()
until("armed", bool)
action.takeoff()
until("in_air", bool)
until("attitude_quaternion", lambda q: q.w > 0.99)
until("position", lambda p: p.relative_altitude_m > 1.0)
print("attitude gain", Param(vehicle).get_param_float("SIM_ATT_P"))
'''


def test_mavsdk_connects_arms_takes_off_and_reads_attitude():
    companion, ground = free_port(), free_port()
    links = ("--link", f"udpout:127.0.0.1:{companion}", "--gcs", f"udpout:127.0.0.1:{ground}")
    root = Path(__file__).parents[2]
    vehicle = subprocess.Popen(
        [sys.executable, "-m", "sitl", "--await-arming", *links], cwd=root, stderr=subprocess.PIPE
    )
    try:
        station = subprocess.run(
            [sys.executable, "-c", STATION, f"udpin://127.0.0.1:{ground}"],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    finally:
        vehicle.terminate()
        _, err = vehicle.communicate(timeout=30)
    assert station.returncode == 0, station.stderr + err.decode()
    assert "attitude gain 6.5" in station.stdout
    assert vehicle.returncode == 0
