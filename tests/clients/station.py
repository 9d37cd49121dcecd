"""MAVSDK lists, reads and toggles the companion's parameters: `python -m tests.clients.station URL`.

A process of its own, because MAVSDK's native threads are no guests for a test runner. Prints one JSON object.
"""

import contextlib
import json
import sys

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.param import Param, ParamError, ProtocolVersion


def main(url):
    station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    station.add_any_connection(url)
    param = Param(station.first_autopilot(30.0))
    found = {}
    with contextlib.suppress(ParamError):  # MAVSDK 4.1 reports UNKNOWN here and selects all the same
        param.select_component(191, ProtocolVersion.V1)
    listed = param.get_all_params()
    found["floats"] = {p.name: p.value for p in listed.float_params}
    found["others"] = [p.name for p in (*listed.int_params, *listed.custom_params)]
    found["limit"] = param.get_param_float("DOB_LIMIT")
    for wish in (1.0, 0.0):
        param.set_param_float("DOB_ENABLE", wish)
        found[f"after float {wish:g}"] = param.get_param_float("DOB_ENABLE")
    for wish in (1, 0):  # our parameters are real numbers: MAVSDK may say so, but a switch must be a switch
        try:
            param.set_param_int("DOB_ENABLE", wish)
        except ParamError as refusal:
            found["integers"] = refusal.result.name
        found[f"after int {wish}"] = param.get_param_float("DOB_ENABLE")
    for name, value in (("DOB_NOPE", 1.0), ("DOB_STATE", 4.0), ("DOB_GAIN", 9.0)):
        try:
            param.set_param_float(name, value)
        except ParamError as refusal:
            found[name] = refusal.result.name
    found["state"] = param.get_param_float("DOB_STATE")
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1])
