"""AUTO.MISSION: one item after the other, one step of the machine per cycle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto

from app.simulator.mission.item import LAND_COMMANDS, TAKEOFF_COMMANDS, Item
from app.simulator.mission.store import MissionStore
from app.simulator.navigator.arrival import Arrival
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.jumps import JumpCounter
from app.simulator.navigator.target import Target, target_of
from app.simulator.payload import PayloadDeliverer
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, Severity, VtolState

CLIMB_TOLERANCE_M = 0.8


@dataclass(slots=True)
class MissionResult:
    """What the navigator publishes about the mission (mission_result)."""

    valid: bool = False
    finished: bool = False
    started: bool = False
    seq_current: int = 0
    seq_reached: int = -1


class _Stage(Enum):
    ITEM = auto()
    CLIMB = auto()
    """Straight up before a position item, because the vehicle stands on the ground."""
    TRANSITION = auto()
    """A VTOL changes to fixed wing after its takeoff, or back before its landing."""
    MOVE_TO_LAND = auto()


class MissionMode:
    """Executes the stored mission and writes `result`."""

    def __init__(
        self, context: NavContext, store: MissionStore, result: MissionResult, payload: PayloadDeliverer
    ) -> None:
        self.result = result
        self.active = False
        self._context = context
        self._store = store
        self._payload = payload
        self._arrival = Arrival(context)
        self._jumps = JumpCounter()
        self._stage = _Stage.ITEM
        self._item_started_s = 0.0
        self._activated = False
        self._pending_seq: int | None = None

    # requests -----------------------------------------------------------------------------------------------

    def mission_changed(self) -> None:
        """A new mission is stored and was checked; in mission mode it is flown at once."""
        self.result.seq_current = self._store.current_seq
        self.result.seq_reached = -1
        self.result.finished = False
        self.result.started = self.active
        self._jumps.reset()
        self._pending_seq = None
        if self.active and self.result.valid:
            self._begin()

    def set_current(self, seq: int, at_once: bool) -> bool:
        """MISSION_SET_CURRENT, or command 224, which outside mission mode waits for the entry into it."""
        if not 0 <= seq < len(self._store.mission):
            return False
        if self.active or at_once:
            self._go_to(seq)
            self.result.finished = False
            if self.active:
                self._begin()
        else:
            self._pending_seq = seq
        return True

    # FlightMode ---------------------------------------------------------------------------------------------

    def activate(self) -> None:
        context = self._context
        if self._pending_seq is not None:
            self._go_to(self._pending_seq)
            self._pending_seq = None
        if not context.state.status.armed:
            return
        last = self._store.current_seq + 1 >= len(self._store.mission)
        if self.result.finished and self._activated and last and context.state.status.landed:
            self._go_to(0)
            self._jumps.reset()
        self._activated = True
        self.result.finished = False
        self.result.started = True
        context.cruise_speed_m_s = math.nan
        if self.result.valid:
            context.text(Severity.INFO, "Executing Mission")
            context.event("mission_execute")
            self._begin()

    def step(self) -> None:
        if not self.result.valid or self.result.finished:
            return
        if self._stage is not _Stage.ITEM:
            self._step_preparation()
            return
        item = self._item
        if not self._completed(item):
            return
        self.result.seq_reached = self._store.current_seq
        if item.autocontinue:
            self._advance()

    # the machine --------------------------------------------------------------------------------------------

    @property
    def _item(self) -> Item:
        return self._store.mission.items[self._store.current_seq]

    def _target(self, item: Item) -> Target:
        return target_of(item, self._context.frame, self._context.home, self._context.params)

    def _go_to(self, seq: int) -> None:
        self._store.current_seq = seq
        self.result.seq_current = seq
        self._stage = _Stage.ITEM

    def _advance(self) -> None:
        following = self._jumps.after(self._store.mission.items, self._store.current_seq)
        if following is None:
            self._finish()
            return
        self._go_to(following)
        self._begin()

    def _finish(self) -> None:
        context = self._context
        landed = context.state.status.landed
        context.text(Severity.INFO, f"Mission finished, {'landed' if landed else 'loitering'}")
        context.event("mission_finished" if landed else "mission_finished_loiter")
        self.result.finished = True
        kind = SetpointKind.IDLE if landed else SetpointKind.LOITER
        context.set_point(kind, context.stop_point(), context.state.body.up_m)

    def _begin(self) -> None:
        """Start the current item."""
        context = self._context
        resolved = self._jumps.resolve(self._store.mission.items, self._store.current_seq)
        if resolved is None:
            self._finish()
            return
        if resolved != self._store.current_seq:
            self._go_to(resolved)
        item = self._item
        self._item_started_s = context.now_s
        self._stage = _Stage.ITEM
        if not item.has_position:
            if item.command == Cmd.NAV_RETURN_TO_LAUNCH:  # ends the mission in the same cycle
                self.result.seq_reached = self._store.current_seq
                self._finish()
            context.command((item.command, (item.param1, item.param2, item.param3, item.param4)))
            return
        target = self._target(item)
        if self._must_climb(item):
            self._climb(target)
        elif item.command in LAND_COMMANDS and self._must_move_to_land(target):
            self._stage = _Stage.MOVE_TO_LAND
            self._arrival.start()
            context.set_point(SetpointKind.POSITION, target.point, max(context.state.body.up_m, target.up_m))
        else:
            self._fly(item, target)

    def _must_climb(self, item: Item) -> bool:
        context = self._context
        hovering = context.airframe.can_hover and context.hovers
        return hovering and context.state.status.landed and item.command not in LAND_COMMANDS

    def _climb(self, target: Target) -> None:
        context = self._context
        body = context.state.body
        up_m = max(target.up_m, body.up_m + float(context.params["MIS_TAKEOFF_ALT"]))
        context.text(Severity.INFO, f"Climb to {up_m - context.home.up_m:.1f} meters above home")
        context.event("mission_climb_before_start")
        self._stage = _Stage.CLIMB
        context.set_point(SetpointKind.TAKEOFF, (body.north_m, body.east_m), up_m)

    def _must_move_to_land(self, target: Target) -> bool:
        context = self._context
        if context.airframe.is_rover or context.airframe.is_fixed_wing:
            return False
        body = context.state.body
        away_m = math.dist((body.north_m, body.east_m), target.point)
        return context.flies_like_plane or away_m > target.acceptance_radius_m

    def _step_preparation(self) -> None:
        context = self._context
        item = self._item
        target = self._target(item)
        if self._stage is _Stage.CLIMB:
            if context.state.body.up_m < context.setpoint.up_m - CLIMB_TOLERANCE_M:
                return
            if item.command == Cmd.NAV_VTOL_TAKEOFF and context.hovers:
                self._stage = _Stage.TRANSITION
                context.command((Cmd.DO_VTOL_TRANSITION, (float(VtolState.FW), 0.0, 0.0, 0.0)))
                return
            self._fly(item, target)
        elif self._stage is _Stage.TRANSITION:
            wanted = VtolState.FW if item.command == Cmd.NAV_VTOL_TAKEOFF else VtolState.MC
            if context.state.status.vtol_state == wanted:
                self._fly(item, target)
        elif self._near_landing(target):
            if context.flies_like_plane:
                self._stage = _Stage.TRANSITION
                context.command((Cmd.DO_VTOL_TRANSITION, (float(VtolState.MC), 0.0, 0.0, 0.0)))
            else:
                self._fly(item, target)

    def _near_landing(self, target: Target) -> bool:
        body = self._context.state.body
        distance_m = math.dist((body.north_m, body.east_m), target.point)
        return distance_m <= self._arrival.switch_radius_m(target)

    def _fly(self, item: Item, target: Target) -> None:
        context = self._context
        body = context.state.body
        self._stage = _Stage.ITEM
        self._arrival.start()
        kind, up_m = SetpointKind.POSITION, target.up_m
        if target.is_takeoff and context.state.status.landed:
            kind = SetpointKind.TAKEOFF
        elif target.is_landing:
            kind = SetpointKind.LAND
        elif target.is_loiter:
            kind = SetpointKind.LOITER
        setpoint = context.set_point(
            kind,
            target.point,
            up_m,
            next_point=self._next_point(item),
            previous=(body.north_m, body.east_m),
            acceptance_radius_m=target.acceptance_radius_m,
        )
        setpoint.loiter_radius_m = target.loiter_radius_m
        setpoint.loiter_clockwise = target.loiter_clockwise

    def _next_point(self, item: Item) -> tuple[float, float] | None:
        """Where the track goes on; None makes a multicopter stop (PX4: brake_for_hold)."""
        context = self._context
        items = self._store.mission.items
        following = items[self._store.current_seq + 1 :]
        waits = context.hovers and (item.command == Cmd.NAV_WAYPOINT and item.param1 > 0.0)
        gripper_next = bool(following) and following[0].command in (Cmd.DO_GRIPPER, Cmd.DO_WINCH)
        if waits or not item.autocontinue or (context.profile.gripper_items_brake and gripper_next):
            return None
        for candidate in following:
            if candidate.has_position:
                return None if candidate.command in TAKEOFF_COMMANDS else self._target(candidate).point
        return None

    # completion ---------------------------------------------------------------------------------------------

    def _completed(self, item: Item) -> bool:
        context = self._context
        elapsed_s = context.now_s - self._item_started_s
        if item.has_position:
            return self._arrival.completed(self._target(item))
        if item.command == Cmd.NAV_DELAY:
            return elapsed_s >= item.param1
        if item.command in (Cmd.DO_GRIPPER, Cmd.DO_WINCH):
            return self._delivered(elapsed_s)
        if item.command == Cmd.DO_VTOL_TRANSITION:
            return context.state.status.vtol_state == int(item.param1) or not context.airframe.is_vtol
        return True

    def _delivered(self, elapsed_s: float) -> bool:
        """Since v1.16 a payload item ends after MIS_COMMAND_TOUT alone; before, also with the gripper's ack."""
        profile = self._context.profile
        timed_out = elapsed_s >= float(self._context.params[profile.command_timeout_param])
        if profile.gripper_items_wait_for_ack:
            return timed_out or not self._payload.in_progress
        return timed_out
