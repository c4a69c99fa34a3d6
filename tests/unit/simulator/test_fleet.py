"""The fleet and its command line: who sends where, how fast time runs, and the same flight for the same seed."""

from __future__ import annotations

import asyncio

import pytest

from app.simulator.dialect import mavlink
from app.simulator.fleet import Fleet
from app.simulator.options import Options, VehicleOptions, parse
from tests.support.simulated_vehicle import RELEASE, RETURN, GroundStation, takeoff, waypoint


def test_the_command_line_names_the_vehicles() -> None:
    home = ["--home", "47,8.5,400"]
    options = parse(["--fleet", "quad,quad:sysid=7:gripper=external,plane:winch=1", "--speed", "10", *home])
    assert options.fleet == (
        VehicleOptions("quad", 1),
        VehicleOptions("quad", 7, external_gripper=True),
        VehicleOptions("plane", 3, winch=True),
    )
    assert (options.speed, options.home) == (10.0, (47.0, 8.5, 400.0))
    assert parse(["--params", "NAV_ACC_RAD=3.5,NAV_DLL_ACT=2"]).params == (("NAV_ACC_RAD", 3.5), ("NAV_DLL_ACT", 2))


@pytest.mark.parametrize(
    "wrong",
    [
        ["--fleet", "submarine"],
        ["--fleet", ""],
        ["--fleet", "quad:colour=red"],
        ["--fleet", "quad:gripper=robot"],
        ["--fleet", "quad:sysid=0"],
        ["--fleet", "quad:sysid=x"],
        ["--speed", "0.5"],
        ["--speed", "51"],
        ["--speed", "fast"],
        ["--home", "47,8"],
        ["--home", "97,8,0"],
        ["--port", "70000"],
        ["--params", "NAV_ACC_RAD"],
        ["--firmware", "ardupilot"],
    ],
)
def test_a_wrong_command_line_ends_with_status_2(wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        parse(wrong)
    assert end.value.code == 2
    assert "error:" in capsys.readouterr().err


async def test_every_vehicle_has_its_own_port_or_all_share_one() -> None:
    fleet = (VehicleOptions("quad", 1), VehicleOptions("quad", 2))
    own, shared = (
        Fleet(Options(fleet=fleet, port=24_980, local_port=0)),
        Fleet(Options(fleet=fleet, port=24_980, local_port=0, shared_port=True)),
    )
    for one, ports in ((own, ["127.0.0.1:24980", "127.0.0.1:24981"]), (shared, ["127.0.0.1:24980"] * 2)):
        await one.open()
        assert [remote for _, remote in one.addresses()] == ports
        assert len({local for local, _ in one.addresses()}) == 2
        one.close()


async def test_vehicle_time_runs_speed_times_faster_than_the_wall() -> None:
    wall_s = [100.0]
    fleet = Fleet(Options(fleet=(VehicleOptions("quad", 1),), port=24_980, local_port=0, speed=10.0), lambda: wall_s[0])
    running = asyncio.create_task(fleet.run())
    await asyncio.sleep(0)
    for _ in range(20):
        wall_s[0] += 0.05
        before_s = fleet.vehicles[0].clock.now_s
        async with asyncio.timeout(5.0):
            while fleet.vehicles[0].clock.now_s < before_s + 0.4:
                await asyncio.sleep(0.001)
    assert fleet.vehicles[0].clock.now_s == pytest.approx(10.0, abs=0.1)
    wall_s[0] += 60.0
    before_s = fleet.vehicles[0].clock.now_s
    async with asyncio.timeout(5.0):
        while fleet.vehicles[0].clock.now_s == before_s:
            await asyncio.sleep(0.001)
    assert fleet.vehicles[0].clock.now_s - before_s < 3.0, "a machine that slept does not make the vehicle leap"
    running.cancel()
    with pytest.raises(asyncio.CancelledError):
        await running


def test_link_loss_times_are_multiplied_by_the_speed_as_px4s_start_up_does() -> None:
    fleet = Fleet(Options(fleet=(VehicleOptions("quad", 1),), speed=4.0))
    assert fleet.vehicles[0].params["COM_OF_LOSS_T"] == 4.0
    assert fleet.vehicles[0].params["COM_DL_LOSS_T"] == 40


def test_a_flight_is_the_same_every_time() -> None:
    def flight() -> list[bytes]:
        gcs = GroundStation()
        gcs.start([takeoff(10), waypoint(30, 0, 10, 2, 1), RELEASE, waypoint(30, 20, 10), RETURN])
        gcs.fly(60.0)
        return [bytes(received.message.get_msgbuf()) for received in gcs.received]

    first = flight()
    assert len(first) > 1000
    assert flight() == first


def test_a_fleet_has_uids_of_its_own() -> None:
    fleet = Fleet(Options(fleet=tuple(VehicleOptions("quad", number) for number in range(1, 21)), seed=3))
    assert len({vehicle.identity.uid for vehicle in fleet.vehicles}) == 20
    again = Fleet(Options(fleet=(VehicleOptions("quad", 1),), seed=3))
    assert again.vehicles[0].identity.uid == fleet.vehicles[0].identity.uid


def test_the_wire_timers_stay_wall_time_at_any_speed() -> None:
    wall_s = [0.0]
    fleet = Fleet(Options(fleet=(VehicleOptions("quad", 1),), speed=50.0), lambda: wall_s[0])
    vehicle = fleet.vehicles[0]
    asked: list[int] = []

    class Ear:
        gcs_heard_s: float | None = None

        def send(self, message: object, system_id: int, component_id: int) -> None:
            if getattr(message, "name", getattr(message, "msgname", "")) == "MISSION_REQUEST_INT":
                asked.append(1)

    ear = Ear()
    vehicle.radio.channels.append(ear)
    count = mavlink.MAVLink_mission_count_message(1, 1, 5, 0, 0)
    vehicle.receive(ear, mavlink.MAVLink(None).decode(bytearray(count.pack(mavlink.MAVLink(None, 245, 190)))))
    for _ in range(500):
        vehicle.step()
        vehicle.poll()
    assert len(asked) == 1, "ten seconds of vehicle time, none of the wall's"
    wall_s[0] = 0.27
    vehicle.poll()
    assert len(asked) == 2
