"""Control from the ground is simulated up to 4x, as its timers are wall clock. Above OFFBOARD is refused."""

from __future__ import annotations

import pytest

from app.simulator.__main__ import main
from app.simulator.fault_control import FaultControl
from app.simulator.fleet import Fleet, build_vehicle
from app.simulator.options import Options, VehicleOptions
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import GroundStation, takeoff, waypoint
from tests.support.speed_caps import stream


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_up_to_four_times_real_time_offboard_is_flown(speed: float) -> None:
    gcs = GroundStation(speed=speed)
    stream(gcs, 0.5)
    assert gcs.set_mode(Mode.OFFBOARD) == [Result.ACCEPTED]
    gcs.arm()
    stream(gcs, 15.0)
    assert gcs.distance_to(20.0, 0.0) < 1.0


@pytest.mark.parametrize("speed", [4.1, 10.0, 50.0])
def test_above_it_is_refused_on_the_ground_with_a_text_that_says_why(speed: float) -> None:
    gcs = GroundStation(speed=speed)
    stream(gcs, 0.5)
    assert gcs.set_mode(Mode.OFFBOARD) == [Result.TEMPORARILY_REJECTED]
    assert gcs.texts()[-1] == f"Offboard refused: simulated at {speed:g}x, limit 4x"
    assert gcs.vehicle.state.status.mode is Mode.LOITER


def test_above_it_is_refused_in_the_air_and_the_mission_goes_on() -> None:
    gcs = GroundStation(speed=10.0)
    gcs.start([takeoff(10), waypoint(100, 0, 10)])
    gcs.until(lambda: gcs.distance_to(0, 0) > 10.0)
    stream(gcs, 0.5)
    assert gcs.set_mode(Mode.OFFBOARD) == [Result.TEMPORARILY_REJECTED]
    stream(gcs, 2.0)
    assert gcs.vehicle.state.status.mode is Mode.MISSION
    gcs.until(lambda: gcs.distance_to(100, 0) < 2.0)


async def test_a_pilot_at_the_sticks_cannot_choose_it_either() -> None:
    fleet = Fleet(Options(fleet=(VehicleOptions("quad", 1),), speed=10.0))
    answer = await FaultControl(fleet).handle({"vehicle": 1, "fault": "mode", "value": "OFFBOARD"})
    assert answer == {"ok": False, "error": "OFFBOARD is not simulated above 4x"}


def test_the_help_says_the_cap(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    said = " ".join(capsys.readouterr().out.split())
    assert "above 4 embedded missions only: OFFBOARD and supervised drops are refused" in said


@pytest.mark.parametrize(("speed", "seconds"), [(1.0, 10.0), (4.0, 10.0), (50.0, 125.0)])
def test_the_start_order_has_as_long_on_the_wall_as_at_the_cap(speed: float, seconds: float) -> None:
    """COM_DISARM_PRFLT disarms a vehicle that is armed and not started: 0.2 s on the wall at 50x are too short."""
    vehicle = build_vehicle(Options(fleet=(), speed=speed), 0, VehicleOptions("quad", 1), lambda: 0.0)
    assert vehicle.params["COM_DISARM_PRFLT"] == seconds


def test_a_start_order_late_by_the_wall_clock_finds_the_vehicle_still_armed() -> None:
    gcs = GroundStation(speed=50.0)
    assert gcs.upload([takeoff(10), waypoint(30, 0, 10)]) == 0
    gcs.arm()
    gcs.fly(50.0)  # a second on the wall
    assert gcs.command(Cmd.MISSION_START) == [Result.ACCEPTED]
    gcs.until(lambda: gcs.distance_to(30, 0) < 5.0)
