"""A return along the mission: on to its landing, or back to its beginning and home.

PX4's RtlMissionFast, RtlMissionFastReverse and RtlDirectMissionLand: positions are passed without their hold times, and
what lies between them is left out.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum, auto

from app.simulator.mission.item import LAND_COMMANDS, TAKEOFF_COMMANDS, Item
from app.simulator.mission.store import MissionStore
from app.simulator.navigator.arrival import Arrival
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.mission_mode import JumpCounter, MissionResult
from app.simulator.navigator.return_plan import NorthEast, Way, return_up_m
from app.simulator.navigator.target import Target, target_of
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, Severity, VtolState

ITEMS_LOOKED_AT = 10_000
"""As many as a mission has at most: whoever finds no position among so many goes in a circle by a jump for ever."""


class _Stage(Enum):
    CLIMB = auto()
    """To the return altitude, before flying straight to the mission's landing."""
    TO_WING = auto()
    """A VTOL that hovers becomes a fixed wing for the long way."""
    PASS = auto()
    """Through a position of the mission."""
    COMMAND = auto()
    """The item before the one that was flown: a reverse begins with it whatever it is."""
    MOVE_TO_LAND = auto()
    TRANSITION = auto()
    LAND = auto()
    OVER = auto()


class PathReturn:
    """Writes `result` and the store's current item, as the mission itself does."""

    def __init__(self, context: NavContext, store: MissionStore, result: MissionResult, jumps: JumpCounter) -> None:
        self._context = context
        self._store = store
        self._result = result
        self._jumps = jumps
        self._arrival = Arrival(context)
        self._stage = _Stage.OVER
        self._way = Way.FORWARD
        self._home: NorthEast = (0.0, 0.0)
        self._landing_point: NorthEast = (0.0, 0.0)
        self._landing_up_m = 0.0
        self._target: Target | None = None
        self._serial = -1
        """Of the mission that it began with: its sequence numbers mean nothing in another."""

    def start(
        self, way: Way, home: NorthEast, landing_start: int | None, landing: int | None, from_mission: bool
    ) -> None:
        """Begin, in the air. `landing` is the mission's LAND. From another mode than mission: at the nearest item."""
        context = self._context
        self._way, self._home, self._serial = way, home, self._store.mission_serial
        self._result.finished, self._result.seq_reached = False, -1
        context.text(Severity.INFO, "Executing Mission")
        context.event("mission_execute")
        current = self._store.current_seq
        if way is Way.TO_LANDING:
            self._repeat_speed(landing_start or 0)
            self._climb_to(landing_start or 0, landing)
        elif way is Way.REVERSE:
            first = max(current - 1, 0) if from_mission else self._nearest() or 0
            self._repeat_speed(first)
            self._go_to(first)
            self._take_wing()
        else:
            following = self._position_from(current) if from_mission else self._nearest()
            following = following if following is not None else landing
            self._repeat_speed(current if following is None else following)
            self._begin(following)

    def step(self) -> None:
        """One cycle. A mission that was changed or cleared ends it, as a mission that has no more positions."""
        context, status = self._context, self._context.state.status
        if self._serial != self._store.mission_serial and self._stage is not _Stage.OVER:
            self._begin(None)
        match self._stage:
            case _Stage.CLIMB if self._high_enough():
                self._take_wing()
            case _Stage.TO_WING if not context.hovers:
                self._begin_here()
            case _Stage.PASS if self._target is not None and self._arrival.completed(self._target):
                self._passed()
            case _Stage.COMMAND if self._commanded():
                self._passed()
            case _Stage.MOVE_TO_LAND if self._at_landing_point():
                self._over_landing_point()
            case _Stage.TRANSITION if status.vtol_state == VtolState.MC:
                self._move_to_land()
            case _Stage.LAND if status.landed:
                self._result.seq_reached = self._store.current_seq
                self._finish("landed", "mission_finished", SetpointKind.IDLE)

    def _repeat_speed(self, first: int) -> None:
        """The last change of speed before it, unless a transition follows (replayCachedSpeedChangeItems)."""
        for item in reversed(self._items[:first]):
            if item.command == Cmd.DO_VTOL_TRANSITION:
                return
            if item.command == Cmd.DO_CHANGE_SPEED:
                self._context.command((item.command, (item.param1, item.param2, item.param3, item.param4)))
                return

    # along the items ----------------------------------------------------------------------------------------

    @property
    def _items(self) -> tuple[Item, ...]:
        return self._store.mission.items

    def _go_to(self, seq: int) -> None:
        self._store.current_seq = self._result.seq_current = seq

    def _take_wing(self) -> None:
        """Before each item of a way that is not the mission's own."""
        context = self._context
        if context.airframe.is_vtol and context.hovers:
            self._stage = _Stage.TO_WING
            context.command((Cmd.DO_VTOL_TRANSITION, (float(VtolState.FW), 0.0, 0.0, 0.0)))
        else:
            self._begin_here()

    def _begin_here(self) -> None:
        """At the store's item; a landing's marker is none that is flown."""
        seq = self._store.current_seq
        self._begin(seq if self._way is Way.REVERSE else self._position_from(seq))

    def _begin(self, seq: int | None) -> None:
        """Fly an item, whatever it is, in this direction."""
        context = self._context
        if seq is None:
            self._finish("loitering", "mission_finished_loiter", SetpointKind.LOITER)
            return
        self._go_to(seq)
        item = self._items[seq]
        if not item.has_position:
            self._stage = _Stage.COMMAND
            context.command((item.command, (item.param1, item.param2, item.param3, item.param4)))
            return
        target = target_of(item, context.frame, context.home, context.params)
        if target.is_landing and self._way is not Way.REVERSE:
            self._land_at(target.point, target.up_m)
        else:
            self._pass_through(target)

    def _pass_through(self, target: Target) -> None:
        """As a waypoint, without holding; LOITER_TO_ALT stays what it is."""
        context = self._context
        if target.command != Cmd.NAV_LOITER_TO_ALT:
            target = replace(target, command=Cmd.NAV_WAYPOINT, hold_s=0.0)
        self._target, self._stage = target, _Stage.PASS
        self._arrival.start()
        body, circles = context.state.body, target.is_loiter and context.flies_like_plane
        after = self._ahead()
        setpoint = context.set_point(
            SetpointKind.LOITER if target.is_loiter else SetpointKind.POSITION,
            target.point,
            max(body.up_m, target.up_m) if circles else target.up_m,
            next_point=after.point if after is not None else None,
            previous=(body.north_m, body.east_m),
            acceptance_radius_m=target.acceptance_radius_m,
        )
        setpoint.next_lands = after is not None and after.is_landing
        setpoint.loiter_radius_m, setpoint.loiter_clockwise = target.loiter_radius_m, target.loiter_clockwise

    def _passed(self) -> None:
        """On to the next; back at the takeoff, or at the first position, it lands at home."""
        seq = self._store.current_seq
        self._result.seq_reached = seq
        following = self._following()
        if self._way is Way.REVERSE and (following is None or self._items[seq].command in TAKEOFF_COMMANDS):
            self._land_at(self._home, self._context.home.up_m)
        elif self._way is Way.FORWARD or following is None:
            self._begin(following)
        else:
            self._go_to(following)
            self._take_wing()

    def _commanded(self) -> bool:
        item = self._items[self._store.current_seq]
        return item.command != Cmd.DO_VTOL_TRANSITION or self._context.state.status.vtol_state == int(item.param1)

    def _following(self) -> int | None:
        return self._before() if self._way is Way.REVERSE else self._position_from(self._store.current_seq + 1)

    def _before(self) -> int | None:
        """Modelled: jumps are passed over on the way back."""
        return next((seq for seq in reversed(range(self._store.current_seq)) if self._items[seq].has_position), None)

    def _ahead(self) -> Target | None:
        """Where the way goes on without a stop; jumps are not looked through, as in the mission itself."""
        context, seq = self._context, self._before()
        if self._way is not Way.REVERSE:
            after = range(self._store.current_seq + 1, len(self._items))
            seq = next((one for one in after if self._items[one].has_position), None)
        return target_of(self._items[seq], context.frame, context.home, context.params) if seq is not None else None

    def _position_from(self, seq: int) -> int | None:
        """The first position at `seq` or after it, as the mission would go on; None if it never comes to one."""
        found = self._jumps.resolve(self._items, seq)
        for _ in range(ITEMS_LOOKED_AT):
            if found is None or self._items[found].has_position:
                return found
            found = self._jumps.after(self._items, found)
        return None

    def _nearest(self) -> int | None:
        """In space; a plane does not begin with a LAND."""
        context, body = self._context, self._context.state.body
        here = (body.north_m, body.east_m, body.up_m)
        distances = {}
        for seq, item in enumerate(self._items):
            if item.has_position and not (context.airframe.is_fixed_wing and item.command in LAND_COMMANDS):
                target = target_of(item, context.frame, context.home, context.params)
                distances[seq] = math.dist(here, (*target.point, target.up_m))
        return min(distances, key=distances.__getitem__, default=None)

    # the ends -----------------------------------------------------------------------------------------------

    def _climb_to(self, landing_start: int, landing: int | None) -> None:
        """First the return altitude where it is, then straight to where the landing begins."""
        context = self._context
        self._go_to(landing_start)
        item = self._items[landing if landing is not None else landing_start]
        target = target_of(item, context.frame, context.home, context.params)
        up_m = return_up_m(context, target.point, target.up_m)
        self._stage = _Stage.CLIMB
        context.set_point(SetpointKind.LOITER, context.stop_point(), up_m)
        if not self._high_enough():
            amsl_m = math.ceil(context.frame.altitude_m + up_m)
            context.text(Severity.INFO, f"RTL Mission land: climb to {amsl_m} m")
            context.event("rtl_mission_land_climb", amsl_m)

    def _high_enough(self) -> bool:
        context = self._context
        tolerance_m = float(context.params["NAV_FW_ALT_RAD" if context.flies_like_plane else "NAV_MC_ALT_RAD"])
        return context.state.body.up_m >= context.setpoint.up_m - tolerance_m

    def _land_at(self, point: NorthEast, up_m: float) -> None:
        """What hovers, or can, flies over the point first; a plane descends from where it is."""
        self._landing_point, self._landing_up_m = point, up_m
        if self._context.airframe.is_fixed_wing or self._context.airframe.is_rover:
            self._land()
        else:
            self._move_to_land()

    def _move_to_land(self) -> None:
        self._stage = _Stage.MOVE_TO_LAND
        body = self._context.state.body
        self._context.set_point(SetpointKind.POSITION, self._landing_point, max(body.up_m, self._landing_up_m))

    def _at_landing_point(self) -> bool:
        body = self._context.state.body
        distance_m = math.dist((body.north_m, body.east_m), self._landing_point)
        return distance_m <= float(self._context.params["NAV_ACC_RAD"])

    def _over_landing_point(self) -> None:
        if self._context.flies_like_plane:
            self._stage = _Stage.TRANSITION
            self._context.command((Cmd.DO_VTOL_TRANSITION, (float(VtolState.MC), 0.0, 0.0, 0.0)))
        else:
            self._land()

    def _land(self) -> None:
        context, body = self._context, self._context.state.body
        self._stage = _Stage.LAND
        distance_m = math.dist((body.north_m, body.east_m), self._landing_point)
        here = (body.north_m, body.east_m) if context.flies_like_plane else None
        setpoint = context.set_point(SetpointKind.LAND, self._landing_point, self._landing_up_m, previous=here)
        if distance_m > 1.0:
            setpoint.approach_slope = (body.up_m - self._landing_up_m) / distance_m

    def _finish(self, how: str, event: str, kind: SetpointKind) -> None:
        context = self._context
        self._stage = _Stage.OVER
        context.text(Severity.INFO, f"Mission finished, {how}")
        context.event(event)
        self._result.finished = True
        context.end_there()
        context.setpoint.kind = kind
