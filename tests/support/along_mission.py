"""A return along a mission, cycle by cycle, at places that are set by hand."""

from __future__ import annotations

import math

from app.simulator.navigator.mission_mode import JumpCounter
from app.simulator.navigator.path_return import PathReturn
from app.simulator.navigator.return_plan import Way
from app.simulator.params import Value
from app.simulator.setpoint import SetpointKind
from app.simulator.state import Home
from app.simulator.wire import Cmd
from tests.support.airborne_vehicle import Airborne, Place
from tests.support.simulated_vehicle import RELEASE, Plan, do, land, takeoff, waypoint

HOME_UP_M = 5.0
LOITER_DOWN = Plan(Cmd.NAV_LOITER_TO_ALT, 900.0, 0.0, 30.0, (0.0, -70.0, 0.0, math.nan))
WAIT = Plan(Cmd.NAV_LOITER_TIME, 900.0, 0.0, 30.0, (60.0, 0.0, 70.0, math.nan))
PLANS = [
    takeoff(15),  # 0
    waypoint(100, 0, 15, 60, 4),
    do(Cmd.DO_LAND_START),
    waypoint(100, 100, 25, 60, 6),
    RELEASE,
    waypoint(0, 100, 25),  # 5
    land(0, 200),
]
GARDEN = (0.0, 200.0)
HOME = (-50.0, -50.0)
TO_WING, TO_HOVER = ((Cmd.DO_VTOL_TRANSITION, (state, 0.0, 0.0, 0.0)) for state in (4.0, 3.0))


class Along:
    """Its home is 5 m above the ground of the frame."""

    def __init__(
        self,
        way: Way = Way.FORWARD,
        current: int = 1,
        airframe: str = "quad",
        plans: list[Plan] = PLANS,
        at: Place = (0.0, 0.0, 20.0),
        from_mission: bool = True,
        **params: Value,
    ) -> None:
        self.air = air = Airborne(airframe, at, **params)
        air.status.home = Home(0.0, 0.0, HOME_UP_M)
        air.upload(plans)
        air.store.current_seq = current
        air.result.finished, air.result.seq_reached = True, 4
        seqs = {plan.command: seq for seq, plan in reversed(list(enumerate(plans)))}
        landing = seqs.get(Cmd.NAV_LAND, seqs.get(Cmd.NAV_VTOL_LAND))
        self.setpoint = air.context.setpoint
        self.path = PathReturn(air.context, air.store, air.result, JumpCounter())
        self.path.start(way, HOME, seqs.get(Cmd.DO_LAND_START, landing), landing, from_mission)

    @property
    def seq(self) -> int:
        assert self.air.result.seq_current == self.air.store.current_seq
        return self.air.store.current_seq

    @property
    def flies(self) -> tuple[SetpointKind, tuple[int, int], float]:
        """Kind, place and height above home of the setpoint, in whole metres."""
        north_m, east_m = self.setpoint.point
        return self.setpoint.kind, (round(north_m), round(east_m)), round(self.setpoint.up_m - HOME_UP_M, 1)

    def at(self, north_m: float, east_m: float, above_m: float, cycles: int = 1) -> Along:
        """Some cycles at that place."""
        self.air.place(north_m, east_m, HOME_UP_M + above_m)
        self.air.run(self.path.step, cycles * 0.02)
        return self
