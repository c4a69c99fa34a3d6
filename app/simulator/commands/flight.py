"""Commands that change how the vehicle flies: modes, arming, takeoff, landing, speed, mission index."""

from __future__ import annotations

import math
from collections.abc import Callable

from app.simulator.commander import Commander, is_force
from app.simulator.commands.link import Handler, Request
from app.simulator.geofence_breach import HOLD, breaches_at
from app.simulator.mission.geofence import Geofence
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.mission_mode import MissionMode
from app.simulator.navigator.modes import HoldMode, Reposition, TakeoffMode
from app.simulator.navigator.orbit_mode import OrbitCommand, OrbitMode
from app.simulator.state import Home
from app.simulator.wire import Cmd, Mode, Result, Severity, VtolState

CUSTOM_MODE_ENABLED = 1
REPOSITION_CHANGES_MODE = 1
AUTO_MAIN = 4
USES_CURRENT = 0.5
"""DO_SET_HOME, param1: above, home is where the vehicle is."""


class FlightCommands:
    """Handlers for the command link."""

    def __init__(
        self,
        context: NavContext,
        commander: Commander,
        mission: MissionMode,
        hold: HoldMode,
        takeoff: TakeoffMode,
        orbit: OrbitMode,
        transition: Callable[[float], Result],
        fence: Callable[[], Geofence],
    ) -> None:
        self._context = context
        self._commander = commander
        self._mission = mission
        self._hold = hold
        self._takeoff = takeoff
        self._orbit = orbit
        self._transition = transition
        self._fence = fence

    def handlers(self) -> dict[int, Handler]:
        """Command number to handler."""
        return {
            Cmd.COMPONENT_ARM_DISARM: self._arm_disarm,
            Cmd.DO_SET_MODE: self._set_mode,
            Cmd.MISSION_START: lambda request: self._commander.mission_start(),
            Cmd.NAV_TAKEOFF: self._nav_takeoff,
            Cmd.NAV_LAND: lambda request: self._commander.land(),
            Cmd.NAV_RETURN_TO_LAUNCH: lambda request: self._commander.return_to_launch(),
            Cmd.DO_ORBIT: self._do_orbit,
            Cmd.DO_REPOSITION: self._reposition,
            Cmd.DO_CHANGE_SPEED: self._change_speed,
            Cmd.DO_SET_HOME: self._set_home,
            Cmd.DO_SET_MISSION_CURRENT: self._set_mission_current,
            Cmd.DO_VTOL_TRANSITION: lambda request: self._transition(request.param1),
        }

    def _arm_disarm(self, request: Request) -> Result:
        force = is_force(request.param2)
        if not math.isfinite(request.param1):
            return Result.UNSUPPORTED
        if round(request.param1) == 1:
            return self._commander.arm(force)
        if round(request.param1) == 0:
            return self._commander.disarm(force)
        return Result.UNSUPPORTED

    def _set_mode(self, request: Request) -> Result:
        if not request.whole(1) & CUSTOM_MODE_ENABLED:
            return Result.TEMPORARILY_REJECTED
        main, sub = request.whole(2), request.whole(3)
        value = main << 16 | sub << 24
        try:
            mode = Mode(value if main in (AUTO_MAIN, Mode.ORBIT.main) else main << 16)
        except ValueError:
            return self._commander.unsupported_mode()
        if mode is Mode.DESCEND:
            return self._commander.unsupported_mode()
        return self._commander.set_mode(mode)

    def _nav_takeoff(self, request: Request) -> Result:
        given = math.isfinite(request.z) and request.z != 0.0
        self._takeoff.command_altitude(request.z - self._context.frame.altitude_m if given else None)
        return self._commander.set_mode(Mode.TAKEOFF)

    def _reposition(self, request: Request) -> Result:
        """Commander and navigator each take it by themselves: it holds though the place is refused."""
        changes_mode = request.whole(2) & REPOSITION_CHANGES_MODE
        if not changes_mode and self._context.state.status.mode is not Mode.LOITER:
            return Result.DENIED
        point, up_m = self._place(request)
        if self._fence_allows(point, up_m):
            self._hold.reposition(Reposition(point, up_m, speed_m_s=request.param1))
        else:
            self._context.text(Severity.CRITICAL, "Reposition is outside geofence")
            self._context.event("navigator_reposition_outside_geofence")
        if changes_mode:
            self._commander.change_mode(Mode.LOITER)
        return Result.ACCEPTED

    def _fence_allows(self, point: tuple[float, float] | None, up_m: float) -> bool:
        """A fence that only warns refuses no place; what is not given stays as it is."""
        context = self._context
        if context.params.integer("GF_ACTION") < HOLD:
            return True
        body = context.state.body
        there, height_m = point or (body.north_m, body.east_m), up_m if math.isfinite(up_m) else body.up_m
        return not breaches_at(there, height_m, context.params, context.state.status.home, self._fence())

    def _do_orbit(self, request: Request) -> Result:
        """A plane loiters with that radius; all else changes to the orbit mode [22_reposition_*]."""
        context = self._context
        if context.state.status.vtol_state in (VtolState.TRANSITION_TO_FW, VtolState.TRANSITION_TO_MC):
            context.text(Severity.CRITICAL, "Orbit command rejected")
            return Result.TEMPORARILY_REJECTED
        point, up_m = self._place(request)
        if context.flies_like_plane:
            if self._fence_allows(point, up_m):
                self._hold.reposition(Reposition(point, up_m, orbit_radius_m=request.param1))
            else:
                context.text(Severity.CRITICAL, "Orbit is outside geofence")
            self._commander.change_mode(Mode.LOITER)
            return Result.ACCEPTED
        self._orbit.command(OrbitCommand(request.param1, request.param2, request.param3, point, up_m))
        self._commander.change_mode(Mode.ORBIT)
        return Result.ACCEPTED

    def _place(self, request: Request) -> tuple[tuple[float, float] | None, float]:
        """Params 5 to 7, None and NaN where not given. In every frame z is above sea level [22_reposition_quad]."""
        frame, latitude, longitude = self._context.frame, request.latitude_deg, request.longitude_deg
        given = math.isfinite(latitude) and math.isfinite(longitude)
        point = frame.to_local(latitude, longitude) if given else None
        return point, request.z - frame.altitude_m

    def _set_home(self, request: Request) -> Result:
        if request.param1 > USES_CURRENT:
            return self._commander.set_home(None)
        point, up_m = self._place(request)
        if point is None or not math.isfinite(up_m):
            return Result.DENIED
        return self._commander.set_home(Home(*point, up_m, set_at_s=self._context.now_s))

    def _change_speed(self, request: Request) -> Result:
        self.apply_speed(request.param2)
        return Result.ACCEPTED

    def apply_speed(self, speed_m_s: float) -> None:
        """DO_CHANGE_SPEED: a speed of -1 or less is the default again."""
        speed = speed_m_s if speed_m_s > 0.0 else math.nan
        self._context.change_speed(speed)

    def _set_mission_current(self, request: Request) -> Result:
        """224. -1 keeps the item; outside mission mode it takes effect on entering it."""
        seq = request.whole(1)
        if seq < 0:
            return Result.ACCEPTED
        return Result.ACCEPTED if self._mission.set_current(seq, at_once=False) else Result.FAILED
