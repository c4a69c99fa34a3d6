"""What the suite of the vehicle ports drives links with: conditions with deadlines, facts on record, missions."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from typing import TypeVar

from app.domain.errors import CommandExpiredError, LinkTimeoutError, VehicleRefusedError, VehicleTakenError
from app.domain.mission import MavCmd, MavFrame, Mission, MissionItem, MissionType
from app.domain.ports.vehicle_link import UploadProgress, VehicleLink
from app.domain.vehicle.facts import LinkFact
from app.domain.vehicle.state import FlightMode
from app.vehicles import LinkSettings, MavsdkLinkSource
from tests.support.patience import Patience
from tests.support.simulated import SimulatedFleet

F = TypeVar("F")
HOME = (473977420, 85455940)
"""Of the first simulated vehicle, 1e7 deg."""
DISCOVERED_S = 15.0


async def until(condition: Callable[[], bool], promise: str, within_s: float) -> None:
    """Look every 10 ms; AssertionError names the promise."""
    patience = Patience(within_s)
    while not condition():
        assert not patience.is_over(), f"{promise} within {within_s:g} s"
        await asyncio.sleep(0.01)


STREAMED_S = 1.0
"""Of the vehicle's time: PX4 looks ten times a second whether there is a stream."""


async def streamed_enough(link: VehicleLink) -> None:
    """OFFBOARD may be asked for."""
    began_s = link.state().boot_time_s
    assert began_s is not None
    await until(lambda: (link.state().boot_time_s or 0.0) > began_s + STREAMED_S, "its clock must go on", 20.0)


class ReceivedFacts:
    """The facts of one link, in order."""

    def __init__(self, link: VehicleLink) -> None:
        self.facts: list[LinkFact] = []
        self._link = link
        link.subscribe(self.facts.append)

    def of(self, kind: type[F]) -> list[F]:
        """All facts of one type."""
        return [fact for fact in self.facts if isinstance(fact, kind)]

    async def until(self, kind: type[F], within_s: float, *, after: int = 0) -> F:
        """The first fact of this type beyond the first `after` ones of it."""
        await until(lambda: len(self.of(kind)) > after, f"{kind.__name__} must be told; told: {self.facts}", within_s)
        return self.of(kind)[after]


@asynccontextmanager
async def opened(
    urls: Sequence[str], *, vehicles: int, settings: LinkSettings | None = None
) -> AsyncIterator[MavsdkLinkSource]:
    """A started source that has found that many vehicles; closed afterwards."""
    source = MavsdkLinkSource(urls, settings=settings or LinkSettings())
    await source.start()
    try:
        await until(lambda: len(source.links()) >= vehicles, f"{vehicles} vehicles must be found", DISCOVERED_S)
        yield source
    finally:
        await source.close()


@asynccontextmanager
async def opened_link(urls: Sequence[str], *, settings: LinkSettings | None = None) -> AsyncIterator[VehicleLink]:
    """The one vehicle of a source."""
    async with opened(urls, vehicles=1, settings=settings) as source:
        yield source.links()[0]


def mission(count: int, *, north_m: int = 3, altitude_m: float = 12.0) -> Mission:
    """Takeoff and waypoints in a row to the north, `north_m` apart; the last brings the vehicle home and lands."""
    takeoff = waypoint(0, 0, altitude_m=altitude_m, command=MavCmd.NAV_TAKEOFF)
    between = [waypoint(seq, seq * north_m, altitude_m=altitude_m) for seq in range(1, count - 1)]
    home = MissionItem(count - 1, MavFrame.MISSION, MavCmd.NAV_RETURN_TO_LAUNCH, 0.0, 0.0, 0.0, 0.0)
    return Mission((takeoff, *between, home)[:count])


def waypoint(
    seq: int,
    north_m: int,
    *,
    hold_s: float = 0.0,
    altitude_m: float = 12.0,
    command: MavCmd = MavCmd.NAV_WAYPOINT,
) -> MissionItem:
    """A position item north of home."""
    acceptance_m = 1.0 if command is MavCmd.NAV_WAYPOINT else 0.0
    x = HOME[0] + round(north_m / 111_195 * 1e7)
    frame = MavFrame.GLOBAL_RELATIVE_ALT_INT
    return MissionItem(seq, frame, command, hold_s, acceptance_m, 0.0, x=x, y=HOME[1], z=altitude_m)


def square_fence(half_side_m: int) -> tuple[MissionItem, ...]:
    """An inclusion polygon round home."""
    step = round(half_side_m / 111_195 * 1e7)
    corners = ((1, 1), (1, -1), (-1, -1), (-1, 1))
    return tuple(
        MissionItem(
            seq,
            MavFrame.GLOBAL_RELATIVE_ALT_INT,
            MavCmd.NAV_FENCE_POLYGON_VERTEX_INCLUSION,
            4.0,
            0.0,
            0.0,
            0.0,
            x=HOME[0] + north * step,
            y=HOME[1] + round(east * step * 1.48),
            mission_type=MissionType.FENCE,
        )
        for seq, (north, east) in enumerate(corners)
    )


def rally_point(north_m: int) -> MissionItem:
    """One rally point."""
    return MissionItem(
        0,
        MavFrame.GLOBAL_RELATIVE_ALT_INT,
        MavCmd.NAV_RALLY_POINT,
        0.0,
        0.0,
        0.0,
        0.0,
        x=HOME[0] + round(north_m / 111_195 * 1e7),
        y=HOME[1],
        z=20.0,
        mission_type=MissionType.RALLY,
    )


async def uploaded(link: VehicleLink, what: Mission) -> UploadProgress:
    """Upload to the end; the last step."""
    steps = [step async for step in link.upload(what)]
    assert steps[-1].mission_type is MissionType.MISSION
    return steps[-1]


async def uploaded_without_final_ack(fleet: SimulatedFleet, link: VehicleLink, what: Mission) -> UploadProgress:
    """The same while the mission's own MISSION_ACK gets lost; the fleet is one vehicle."""
    async for step in link.upload(what):
        if step.mission_type is MissionType.MISSION and step.sent == 0 and step.attempt == 1:
            fleet.control("lost_ack", 1)  # what is cleared before is acknowledged
    assert "lost_ack" not in fleet.truth(1)["faults"], "the vehicle must have left out an ack"
    return step


async def collected(steps: AsyncIterator[UploadProgress]) -> list[UploadProgress]:
    """All that is left of an upload."""
    return [step async for step in steps]


async def armed(link: VehicleLink, within_s: float = 15.0) -> None:
    """Arm in Hold, as soon as the vehicle's checks pass; on a busy machine the order or its answer may be late."""
    if link.state().mode is not FlightMode.HOLD:
        await link.hold_disarmed()
    patience, may_be_armed = Patience(within_s), False
    while True:
        try:
            await link.arm()
        except LinkTimeoutError:
            may_be_armed = True
        except (VehicleRefusedError, CommandExpiredError):
            pass
        except VehicleTakenError as error:
            if not (may_be_armed and error.extra["armed"]):
                raise
            return
        else:
            return
        assert not patience.is_over(), f"the vehicle must become armable within {within_s:g} s"
        await asyncio.sleep(0.1)


async def flying(link: VehicleLink, what: Mission) -> None:
    """Upload, wait until it may be started, arm, start, and see the vehicle climb."""
    await started(link, await uploaded(link, what))


async def started(link: VehicleLink, last: UploadProgress) -> None:
    """As `flying`, of the mission that was uploaded last."""
    await link.wait_mission_ready(mission_id=last.mission_id, rerun=False, timeout_s=10.0)
    await armed(link)
    await link.start_mission()
    await until(lambda: (link.state().relative_altitude_m or 0.0) > 3.0, "the vehicle must climb", 20.0)
