"""`python -m bench._mavsdk_answer PORT`: answers each HIGHRES_IMU by a DEBUG_VECT, through MAVSDK's mavlink_direct."""

import json
import sys
import threading

from mavsdk import ComponentType, Configuration, Mavsdk, log_subscribe
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkMessage


def main(port: str) -> None:
    log_subscribe(lambda *_: True)
    sdk = Mavsdk(Configuration.create_with_component_type(ComponentType.COMPANION_COMPUTER))
    sdk.add_any_connection(f"udpin://127.0.0.1:{port}")
    print("listening", flush=True)
    direct = MavlinkDirect(sdk.first_autopilot(30.0))

    def answer(message: MavlinkMessage, _user_data: object) -> None:
        fields = json.loads(message.fields_json)
        correction = {
            "time_usec": fields["time_usec"],
            "name": "DOB_CORR",
            "x": -0.1 * fields["xgyro"],
            "y": -0.1 * fields["ygyro"],
            "z": -0.1 * fields["zgyro"],
        }
        direct.send_message(MavlinkMessage("DEBUG_VECT", 1, 191, 0, 0, json.dumps(correction)))

    direct.subscribe_message("HIGHRES_IMU", answer)
    print("ready", flush=True)
    threading.Event().wait()


if __name__ == "__main__":
    main(sys.argv[1])
