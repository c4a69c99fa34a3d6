"""A return to a rally point: to which one it goes now, by the vehicle's own parameters, and the order itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from app.domain.airspace.rally import RallyDestination, ReturnConditions
from app.domain.autopilot import autopilot, behaviour
from app.domain.errors import ConflictError, DivertRefusedError, LinkTimeoutError
from app.domain.mission import MavCmd, Mission, MissionItem
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.state import FlightMode, LandedState, VehicleProfile, VehicleState, VehicleType
from app.services.runs.monitor import FlightMonitor

_LANDINGS: Final = frozenset({MavCmd.NAV_LAND, MavCmd.NAV_VTOL_LAND})


@dataclass(frozen=True, slots=True)
class RallyChoice:
    """Where a return goes, and the vehicle's parameters that say so."""

    destination: RallyDestination
    parameters: Mapping[str, float | int]


class RallyReturn:
    """Chooses, and chooses again before the command. The return parameters are read each time: another ground
    station may set them.
    """

    def __init__(self, link: VehicleLink, monitor: FlightMonitor) -> None:
        self._link = link
        self._monitor = monitor

    async def choose(self) -> RallyChoice:
        """The destination of a return that starts now; sends no command.

        Raises:
            DivertRefusedError: no rally point, or the choice is uncertain. ConflictError: not in flight, silent, or
            already returning. LinkError: the return parameters cannot be read.
        """
        self._refuse_unfit(self._link.state())
        vehicle_type = self._monitor.flight.segment.plan.vehicle_type
        names = autopilot(self._link.identity.autopilot).return_parameters(vehicle_type)
        found = await self._link.read_parameters(names)
        if names[0] not in found:
            raise LinkTimeoutError(
                f"the vehicle does not report its {names[0]}", hint="send the request again, or return"
            )
        return RallyChoice(self._destination(found), found)

    async def order(self, chosen: RallyChoice) -> None:
        """Return mode, if it still goes to that rally point: the order may have waited while the vehicle flew on.

        Raises:
            DivertRefusedError, ConflictError: as `choose`, or it goes to another one now; nothing was sent. LinkError.
        """
        recorded, now = chosen.destination, self._destination(chosen.parameters)
        if now.index != recorded.index or not {*now.or_index} <= {*recorded.or_index}:
            raise DivertRefusedError(
                f"the vehicle moved while the command waited: it would return to rally point {now.index + 1}",
                hint="order it again",
                refusal="divert.flew_on",
            )
        await self._link.return_to_launch()

    def _destination(self, found: Mapping[str, float | int]) -> RallyDestination:
        state, segment, change = self._link.state(), self._monitor.flight.segment, self._monitor.flight.change
        self._refuse_unfit(state)
        self._refuse_others_points(state, segment.mission)
        does = behaviour(
            VehicleProfile(segment.plan.vehicle_type, parameters=found, autopilot=self._link.identity.autopilot)
        )
        missions = [segment.mission] if change is None or not change.is_open else [segment.mission, change.mission]
        landings = [item for mission in missions for item in mission.items if item.command in _LANDINGS][:2]
        return ReturnConditions(
            vehicle_type=segment.plan.vehicle_type,
            state=state,
            rally=[_place(item) for item in segment.mission.rally],
            landings=[_place(item) for item in landings],
            returns=does.returns,
            there=does.rally_return,
        ).destination()

    def _refuse_unfit(self, state: VehicleState) -> None:
        if not state.connected:
            raise ConflictError("the link to the vehicle is lost", hint="wait until it is connected")
        if (
            state.landed is not LandedState.IN_AIR
            and self._monitor.flight.segment.plan.vehicle_type is not VehicleType.ROVER
        ):
            raise ConflictError("the vehicle is not in flight, or is taking off or landing", hint="wait, or return")
        if state.mode is FlightMode.RETURN:
            raise ConflictError(
                "the vehicle is already returning, to the destination that PX4 chose at the start",
                hint="pause the run, then send the request again",
            )

    def _refuse_others_points(self, state: VehicleState, mission: Mission) -> None:
        """Firmware that names missions names rally points too (MISSION_CURRENT.rally_points_id)."""
        if not mission.rally or state.mission_id is None:
            return
        if state.rally_points_id != self._link.rally_points_id_of(mission):
            raise DivertRefusedError(
                "the rally points on board are not those of the run: another client changed them",
                hint="return, or change the mission to land at another position",
                refusal="divert.other_rally_points",
            )


def _place(item: MissionItem) -> tuple[float, float]:
    return item.x / 1e7, item.y / 1e7
