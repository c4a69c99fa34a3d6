"""A run that is sent to a rally point: it says to which, or why the vehicle would not go there."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import cast

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.errors import (
    ChangeUnderWayError,
    ConflictError,
    DivertRefusedError,
    LinkTimeoutError,
    VehicleRefusedError,
    WrongStateError,
)
from app.domain.reasons import describe
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode, GlobalPosition, LandedState
from tests.support.changed_flight import clinic_moved, fly, store
from tests.support.events import data_of
from tests.support.run_service import RunService, run_service


async def near_the_rally_point(service: RunService, **parameters: float) -> None:
    """In the air, 20 m from the plan's rally point and far from home."""
    service.vehicle.parameters |= {"RTL_TYPE": 0, "RTL_LAND_DELAY": 0.0, **parameters}
    await fly(service)
    point = service.plan.rally_points[0]
    service.vehicle.put(
        home=GlobalPosition(47.397742, 8.545594, 488.0),
        latitude_deg=point.latitude_deg,
        longitude_deg=point.longitude_deg + 20.0 / 75_300,
    )


def refused(error: DivertRefusedError) -> object:
    return error.extra["refusal"]


async def test_the_run_names_the_rally_point_and_why_and_keeps_its_parcel() -> None:
    async with run_service() as service:
        await near_the_rally_point(service)
        run = await service.runs.divert(service.run_id)
        assert run.rally is not None
        assert (run.rally.index, run.commanded, run.rally.lands) == (0, "return", True)
        assert describe(run.rally.reason).startswith(
            "rally point 1, 20 m away: the nearest of home and the rally points"
        )
        assert service.vehicle.sent[-1] == "return"
        await service.until(
            lambda: describe(service.run.reason) == "diverting to rally point 1 by command",
            "it must be told while it returns",
        )
        command = next(event for event in reversed(service.events.events) if event.kind == "run.command")
        assert (data_of(command)["command"], data_of(command)["rally"]["index"]) == ("return", 0)
        service.vehicle.put(armed=False, landed=LandedState.ON_GROUND)
        await service.until_state(RunState.ABORTED)
        assert service.drop.outcome is DropOutcome.KEPT


@pytest.mark.parametrize(
    ("parameters", "because"),
    [({"RTL_TYPE": 2}, "divert.return_type"), ({"RTL_TYPE": 4}, "divert.return_type")],
)
async def test_a_vehicle_that_would_go_elsewhere_flies_on_and_the_reason_is_told(
    parameters: dict[str, float], because: str
) -> None:
    async with run_service() as service:
        await near_the_rally_point(service, **parameters)
        sent = list(service.vehicle.sent)
        with pytest.raises(DivertRefusedError) as error:
            await service.runs.divert(service.run_id)
        assert (refused(error.value), service.vehicle.sent, service.run.commanded, service.run.rally) == (
            because,
            sent,
            None,
            None,
        )


async def test_a_vtol_is_asked_whether_it_wants_landing_approaches() -> None:
    async with run_service("vtol-hover-drop.json") as service:
        facts = service.vehicle.facts
        service.vehicle.facts = replace(facts, parameters={**facts.parameters, "RTL_TYPE": 5})
        service.vehicle.parameters |= {"RTL_TYPE": 5, "RTL_LAND_DELAY": 0.0, "RTL_APPR_FORCE": 1}
        await fly(service, "outbound")
        with pytest.raises(DivertRefusedError) as error:
            await service.runs.divert(service.run_id)
        assert (refused(error.value), "return" in service.vehicle.sent) == ("divert.approach_forced", False)
        del service.vehicle.parameters["RTL_APPR_FORCE"]  # firmware without it
        service.vehicle.put(home=GlobalPosition(47.397742, 8.545594, 488.0))
        assert (await service.runs.divert(service.run_id)).rally is not None


async def test_what_another_ground_station_did_to_the_rally_points_is_noticed() -> None:
    async with run_service() as service:
        await near_the_rally_point(service)
        for named in (12345, None):
            service.vehicle.put(rally_points_id=named)
            with pytest.raises(DivertRefusedError) as error:
                await service.runs.divert(service.run_id)
            assert refused(error.value) == "divert.other_rally_points"
        service.vehicle.put(
            mission_id=None
        )  # firmware that names no missions names no rally points: the upload is believed
        assert (await service.runs.divert(service.run_id)).rally is not None


async def test_it_is_refused_on_the_ground_without_a_link_and_while_it_returns_already() -> None:
    async with run_service() as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        with pytest.raises(WrongStateError):
            await service.runs.divert(service.run_id)
    async with run_service() as service:
        await near_the_rally_point(service)
        for changes in ({"landed": LandedState.ON_GROUND}, {"connected": False}, {"mode": FlightMode.RETURN}):
            before = {name: getattr(service.vehicle.truth, name) for name in changes}
            service.vehicle.put(**changes)
            with pytest.raises(ConflictError):
                await service.runs.divert(service.run_id)
            service.vehicle.put(**before)
        del service.vehicle.parameters["RTL_TYPE"]
        with pytest.raises(LinkTimeoutError, match="RTL_TYPE"):
            await service.runs.divert(service.run_id)
        assert "return" not in service.vehicle.sent


async def test_another_command_forgets_the_rally_point_and_one_that_is_refused_does_not() -> None:
    async with run_service() as service:
        await near_the_rally_point(service)
        await service.runs.divert(service.run_id)

        async def refuse() -> None:
            raise VehicleRefusedError("denied")

        land, service.vehicle.land = service.vehicle.land, refuse  # type: ignore[method-assign]
        with pytest.raises(VehicleRefusedError):
            await service.runs.land(service.run_id)
        assert service.run.rally is not None
        service.vehicle.land = land  # type: ignore[method-assign]
        assert (await service.runs.pause(service.run_id)).rally is None


async def test_a_return_or_abort_amid_it_does_not_turn_the_vehicle_and_the_run_goes_on_naming_the_rally_point() -> None:
    """PX4 chooses where to as Return mode begins: ordered again, it is that mode already."""
    async with run_service() as service:
        await near_the_rally_point(service)
        chosen = (await service.runs.divert(service.run_id)).rally
        await service.until(lambda: service.run.state is RunState.RETURNING, "the vehicle must be seen to return")
        for order in (service.runs.return_to_launch, service.runs.abort):
            assert (await order(service.run_id)).rally == chosen is not None
            assert describe(service.run.reason) == "diverting to rally point 1 by command"
        await service.runs.pause(service.run_id)
        assert (await service.runs.return_to_launch(service.run_id)).rally is None  # it chooses anew


async def test_it_breaks_a_change_of_the_mission_off_but_a_refused_order_does_not() -> None:
    async with run_service() as service:
        await near_the_rally_point(service, RTL_TYPE=2)
        service.vehicle.upload_gate.clear()
        change = asyncio.create_task(
            service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        )
        await service.until(lambda: service.run.changing is not None, "the change must begin")
        with pytest.raises(DivertRefusedError):
            await service.runs.divert(service.run_id)
        assert not change.done()
        service.vehicle.parameters["RTL_TYPE"] = 5
        await service.runs.divert(service.run_id)
        with pytest.raises(ChangeUnderWayError):
            await asyncio.wait_for(change, 10.0)


@pytest.mark.parametrize(
    ("rtl_type", "flown_to", "because"), [(0, 0, "divert.other_is_nearer"), (5, 2, "divert.flew_on")]
)
async def test_a_vehicle_that_flew_on_while_the_order_waited_is_looked_at_again_and_not_commanded(
    rtl_type: int, flown_to: int, because: str
) -> None:
    def second_point(document: dict[str, object]) -> None:
        place = {"latitude_deg": 47.3993, "longitude_deg": 8.5480, "relative_altitude_m": 20.0}
        document["rally_points"] = [*cast("list[object]", document["rally_points"]), place]

    async with run_service(changes=second_point) as service:
        await near_the_rally_point(service, RTL_TYPE=rtl_type)
        service.events.pause()
        order = asyncio.create_task(service.runs.divert(service.run_id))
        await service.until(lambda: service.newest.rally is not None, "it is chosen, and waits for the disk")
        home, points = service.vehicle.truth.home, service.plan.rally_points
        assert home is not None
        here = [home, points[0], points[1]][flown_to]
        service.vehicle.put(latitude_deg=here.latitude_deg, longitude_deg=here.longitude_deg)
        service.events.open.set()
        with pytest.raises(DivertRefusedError) as error:
            await asyncio.wait_for(order, 10.0)
        assert refused(error.value) == because
        assert ("return" in service.vehicle.sent, service.newest.commanded, service.newest.rally) == (False, None, None)
