"""AUTO.RTL: flies the return that RTL_TYPE chooses when the mode is entered."""

from __future__ import annotations

from collections.abc import Callable

from app.simulator.mission.geofence import Geofence
from app.simulator.mission.store import MissionStore
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.direct_return import DirectReturn
from app.simulator.navigator.jumps import JumpCounter
from app.simulator.navigator.mission_mode import MissionResult
from app.simulator.navigator.path_return import PathReturn
from app.simulator.navigator.return_destination import ReturnDestination, Way
from app.simulator.setpoint import SetpointKind


class ReturnMode:
    """`from_mission` is written by the navigator before `activate`: whether mission mode was flown until now."""

    def __init__(
        self,
        context: NavContext,
        store: MissionStore,
        result: MissionResult,
        jumps: JumpCounter,
        fence: Callable[[], Geofence],
    ) -> None:
        self.from_mission = False
        self._context = context
        self._destination = ReturnDestination(context, store, result)
        self._direct = DirectReturn(context, fence)
        self._path = PathReturn(context, store, result, jumps)
        self._flown: DirectReturn | PathReturn = self._direct

    def activate(self) -> None:
        context = self._context
        context.gimbal.start(context.now_s)
        plan = self._destination.choose()
        self._flown = self._direct if plan.way is Way.DIRECT else self._path
        if context.state.status.landed and not context.airframe.is_rover:
            body = context.state.body
            context.set_point(SetpointKind.IDLE, (body.north_m, body.east_m), body.up_m)
            self._direct.stand()
            self._flown = self._direct
        elif plan.way is Way.DIRECT:
            self._direct.start(plan.point)
        else:
            start, land = self._destination.landing_start, self._destination.landing_seq
            self._path.start(plan.way, plan.point, start, land, self.from_mission)

    def step(self) -> None:
        self._flown.step()
