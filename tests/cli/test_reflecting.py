"""A link that sends back whatever the companion says, over a real socket."""

from dob_companion.artifact import dumps
from dob_companion.supervisor import State
from tests.cli.processes import UdpVehicle, daemon
from tests.companion.aircraft import small_design
from tests.ports import free_port


class Mirror(UdpVehicle):
    """Every datagram that it hears goes back as it came, before anybody reads it."""

    def receive(self):
        data = super().receive()
        self.socket.send(data)
        return data


def test_on_a_link_that_reflects_it_flies_and_never_takes_itself_for_another_controller(tmp_path):
    design, port = tmp_path / "design.json", free_port()
    design.write_text(dumps(small_design())[0])
    with daemon(design, port), Mirror(port) as vehicle:
        vehicle.activate().fly(500)
        vehicle.sample += 300  # an interruption of 1.2 s, after which echoes still come in
        vehicle.fly(1250)
        told = [m for m in vehicle.said if m.get_type() == "DEBUG_FLOAT_ARRAY"]
        texts = [m.text for m in vehicle.said if m.get_type() == "STATUSTEXT"]
        assert int(told[-1].data[6]) == State.ACTIVE, texts
        assert not [text for text in texts if "another" in text]
