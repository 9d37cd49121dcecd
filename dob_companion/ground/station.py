"""A ground station on MAVSDK: connect, arm, take off, and the companion's parameters by way of the vehicle."""

import contextlib
import json
import queue
import signal
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

from mavsdk import ComponentType, Configuration, ConnectionResult, Mavsdk, log_subscribe
from mavsdk.plugins.action import Action, ActionError
from mavsdk.plugins.mavlink_direct import MavlinkDirect
from mavsdk.plugins.param import Param, ParamError, ParamResult, ProtocolVersion

from dob_companion.errors import LinkBusyError, NoVehicleError, RefusedError
from dob_companion.runtime.urls import LinkUrl

COMPANION = 191
"""MAV_COMP_ID_ONBOARD_COMPUTER."""

_POLL_S = 0.5
"""How long MAVSDK is waited for at a time: a signal is not noticed sooner."""

_LOOK_S = 0.05
MOST_TEXTS = 1000
"""STATUSTEXTs kept until somebody reads them; what comes beyond is dropped."""

_T = TypeVar("_T")

# MAVSDK prints to the terminal otherwise. Once for the process: a second subscription frees the first, which the
# threads of another station may be in.
log_subscribe(lambda *_: True)


@dataclass(frozen=True, slots=True)
class Telemetry:
    """The companion's DEBUG_FLOAT_ARRAY `DOB`: moments in normalized torque, hover axes."""

    stamp_us: int
    d_hat: tuple[float, ...]
    correction: tuple[float, ...]
    state: int
    delay_samples: int
    rate_hz: float


class GroundStation:
    """One vehicle, seen from the ground. `texts` and `telemetry` fill by themselves from MAVSDK's own threads."""

    def __init__(self, url: LinkUrl, timeout_s: float, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Connect. Raises LinkBusyError for a port that cannot be had, NoVehicleError when nobody is heard in time.

        The companion, once something is asked of it, is waited for as long. `meanwhile` is called every half second
        that no vehicle is there; what it raises ends the waiting.
        """
        self._url, self._timeout_s = url, timeout_s
        self.texts: queue.Queue[str] = queue.Queue(MOST_TEXTS)
        self.telemetry: Telemetry | None = None
        with _signals_held():
            self._mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        try:
            self._open(url)
            self._find(url, timeout_s, meanwhile)
            with _signals_held():
                self._take_up()
        except BaseException:  # Ctrl-C too
            self.close()
            raise

    def _open(self, url: LinkUrl) -> None:
        with _signals_held():
            result = self._mavsdk.add_any_connection(_mavsdk_url(url))
        if result != ConnectionResult.SUCCESS:
            raise LinkBusyError(f"link {url}: cannot be opened: {result.name.lower().replace('_', ' ')}")

    def _find(self, url: LinkUrl, timeout_s: float, meanwhile: Callable[[], None]) -> None:
        deadline = time.monotonic() + timeout_s
        while True:
            left = deadline - time.monotonic()
            with _signals_held():
                self._system = self._mavsdk.first_autopilot(max(0.0, min(_POLL_S, left)))
            if self._system is not None:
                return
            if left <= _POLL_S:
                raise NoVehicleError(f"link {url}: no vehicle was heard within {timeout_s:g} s")
            meanwhile()

    def _take_up(self) -> None:
        self._action = Action(self._system)
        self._direct = MavlinkDirect(self._system)
        self._direct.subscribe_message("STATUSTEXT", self._on_text)
        self._direct.subscribe_message("DEBUG_FLOAT_ARRAY", self._on_floats)
        self._param = Param(self._system)
        with contextlib.suppress(ParamError):  # MAVSDK 4.1 always reports UNKNOWN here, and selects all the same
            self._param.select_component(COMPANION, ProtocolVersion.V1)

    def __enter__(self) -> "GroundStation":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the link."""
        with _signals_held():
            self._mavsdk.destroy()

    def arm(self) -> None:
        """Arm. Raises RefusedError when the vehicle declines."""
        self._asked_vehicle("arm", self._action.arm)

    def take_off(self) -> None:
        """Take off to the vehicle's own take-off altitude. Raises RefusedError when the vehicle declines."""
        self._asked_vehicle("take off", self._action.takeoff)

    def parameters(self) -> dict[str, float]:
        """All parameters of the companion by name. Raises NoVehicleError when it does not answer."""
        found = self._asked_companion("list parameters", self._param.get_all_params)
        if not found.float_params:
            raise self._silent("could not list parameters")
        return {param.name: shortest(param.value) for param in found.float_params}

    def parameter(self, name: str) -> float:
        """One parameter of the companion. Raises NoVehicleError when it does not answer, RefusedError when it does
        not know it."""
        return shortest(self._asked_companion(f"read {name}", lambda: self._param.get_param_float(name)))

    def set_parameter(self, name: str, value: float) -> None:
        """Write a parameter of the companion and see it echoed. Raises NoVehicleError when it does not answer,
        RefusedError when it refuses."""
        self._asked_companion(f"write {name}={value:g}", lambda: self._param.set_param_float(name, value))

    def _asked_vehicle(self, what: str, call: Callable[[], _T]) -> _T:
        try:
            return call()
        except ActionError as problem:
            raise RefusedError(f"the vehicle did not {what}: {_in_words(problem)}") from None

    def _asked_companion(self, what: str, call: Callable[[], _T]) -> _T:
        deadline = time.monotonic() + self._timeout_s
        while COMPANION not in self._system.component_ids():  # else MAVSDK asks for long, and takes silence for a list
            if time.monotonic() >= deadline:
                raise self._silent(f"could not {what}")
            time.sleep(_LOOK_S)
        try:
            return call()
        except ParamError as problem:
            if problem.result is ParamResult.TIMEOUT:
                raise self._silent(f"could not {what}") from None
            raise RefusedError(f"the companion did not {what}: {_in_words(problem)}") from None

    def _silent(self, what: str) -> NoVehicleError:
        return NoVehicleError(
            f"link {self._url}: {what}: the vehicle is there, its companion (component {COMPANION}) does not answer. "
            "Does `dob-companion run` run, and does the vehicle route between its link and this one?"
        )

    def texts_until(self, deadline: float) -> Iterator[str]:
        """STATUSTEXTs as they come, until `deadline` on the monotonic clock."""
        while (left := deadline - time.monotonic()) > 0:
            with contextlib.suppress(queue.Empty):
                yield self.texts.get(timeout=left)

    def _on_text(self, message: Any, _user_data: object) -> None:
        with contextlib.suppress(queue.Full):
            self.texts.put_nowait(str(json.loads(message.fields_json).get("text", "")))

    def _on_floats(self, message: Any, _user_data: object) -> None:
        if message.component_id != COMPANION:
            return
        fields = json.loads(message.fields_json)
        data = fields["data"]
        self.telemetry = Telemetry(
            int(fields["time_usec"]), tuple(data[0:3]), tuple(data[3:6]), int(data[6]), int(data[7]), float(data[8])
        )


@contextlib.contextmanager
def _signals_held() -> Iterator[None]:
    """Ctrl-C and SIGTERM take effect at the end. Between a call of MAVSDK and the note of the handle that it returns
    they would leave that handle behind, and MAVSDK aborts the process when it is destroyed with one outstanding."""
    if threading.current_thread() is not threading.main_thread():  # where Python never runs handlers
        yield
        return
    held: list[int] = []
    before = {n: signal.signal(n, lambda number, _: held.append(number)) for n in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if held:
            signal.raise_signal(held[0])


def _in_words(problem: ParamError | ActionError) -> str:
    return str(problem.result.name).lower().replace("_", " ")


def shortest(value: float) -> float:
    """A REAL32 with the digits that it was written with: 0.3, not 0.30000001192092896."""
    return float(f"{value:.7g}")


def _mavsdk_url(url: LinkUrl) -> str:
    scheme = "tcpout" if url.scheme == "tcp" else url.scheme
    return f"{scheme}://{url.host}:{url.number}"
