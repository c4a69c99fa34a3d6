"""`waydrop up` sends its four vehicles to the connections that Waydrop listens on, or says that it cannot."""

from __future__ import annotations

import pytest

from app.cli.simulator_process import FLEET, SimulatedFleet
from app.config import SettingsError, expand_connection


def fleet(*connections: str) -> SimulatedFleet:
    expanded = [url for entry in connections for url in expand_connection(entry)]
    return SimulatedFleet.for_connections(expanded, speed=1.0, seed=7)


def test_four_ports_in_a_row_take_a_vehicle_each() -> None:
    arguments = fleet("udpin://127.0.0.1:25500..25503").arguments()
    assert arguments[arguments.index("--port") + 1] == "25500"
    assert arguments[arguments.index("--local-port") + 1] == "25540"
    assert "--shared-port" not in arguments


def test_a_lost_offboard_stream_is_hold_for_nobody_holds_sticks_here() -> None:
    arguments = fleet("udpin://0.0.0.0:14540").arguments()
    assert arguments[arguments.index("--params") + 1] == "COM_OBL_RC_ACT=5,COM_LOW_BAT_ACT=3"


def test_one_port_takes_them_all() -> None:
    assert "--shared-port" in fleet("udpin://0.0.0.0:14540").arguments()


def test_the_fleet_is_two_multicopters_a_fixed_wing_and_a_vtol() -> None:
    assert FLEET == ("quad", "quad", "plane", "vtol")
    assert "two multicopters, one fixed wing, one VTOL" in fleet("udpin://0.0.0.0:14540").words()


def test_above_four_times_real_time_it_says_what_is_refused() -> None:
    def words(speed: float) -> str:
        return SimulatedFleet.for_connections(["udpin://127.0.0.1:14540"], speed=speed, seed=7).words()

    assert words(4.0).endswith("4 times real time")
    assert words(10.0).endswith("10 times real time (above 4 times, supervised drops and OFFBOARD are refused)")


@pytest.mark.parametrize(
    "connections",
    [
        ("udpin://127.0.0.1:25500..25502",),
        ("udpin://127.0.0.1:25500", "udpin://127.0.0.1:25502..25504"),
        ("udpin://10.0.0.1:25500..25503",),
        ("serial:///dev/ttyACM0:57600",),
        ("udpin://127.0.0.1:25500..25502", "serial:///dev/ttyACM0:57600"),
    ],
)
def test_connections_that_they_cannot_reach_are_refused(connections: tuple[str, ...]) -> None:
    with pytest.raises(SettingsError, match="cannot reach"):
        fleet(*connections)
