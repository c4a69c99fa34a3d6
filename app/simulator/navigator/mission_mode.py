"""AUTO.MISSION: one item after the other, one step of the machine per cycle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from app.simulator.mission.item import TAKEOFF_COMMANDS, Item
from app.simulator.mission.store import MissionStore
from app.simulator.navigator.arrival import Arrival
from app.simulator.navigator.context import Deployment, NavContext
from app.simulator.navigator.gimbal import PAUSE_CAMERA, as_issued
from app.simulator.navigator.preparation import Preparation
from app.simulator.navigator.target import Target, target_of
from app.simulator.setpoint import SetpointKind
from app.simulator.state import Home
from app.simulator.wire import Cmd, Severity

FOREVER = 65535
"""DO_JUMP with repeat -1, as PX4 stores it."""


class JumpCounter:
    """Counts the jumps of one mission; reset with a new mission or a new start."""

    def __init__(self) -> None:
        self._taken: dict[int, int] = {}
        self._changed: int | None = None

    def reset(self) -> None:
        """Begin to count again."""
        self._taken.clear()

    def take_changed(self) -> int | None:
        """The jump that was counted last, once."""
        changed, self._changed = self._changed, None
        return changed

    def after(self, items: Sequence[Item], seq: int) -> int | None:
        """The item after `seq`, or None at the end of the mission."""
        return self.resolve(items, seq + 1)

    def resolve(self, items: Sequence[Item], seq: int, *, counts: bool = True) -> int | None:
        """`seq` itself, or where the jumps from there lead. None past the end or for jumps in a circle.

        `counts`: they are taken; else it is only looked where they would lead.
        """
        for _ in range(len(items) + 1):
            if not 0 <= seq < len(items):
                return None
            item = items[seq]
            if item.command != Cmd.DO_JUMP:
                return seq
            limit = FOREVER if item.param2 < 0 else int(item.param2)
            if self._taken.get(seq, 0) < limit:
                if counts and limit != FOREVER:
                    self._taken[seq] = self._taken.get(seq, 0) + 1
                    self._changed = seq
                seq = int(item.param1)
            else:
                seq += 1
        return None


PAYLOAD_COMMANDS = (Cmd.DO_GRIPPER, Cmd.DO_WINCH)


def next_target(context: NavContext, items: Sequence[Item], seq: int, jumps: JumpCounter) -> Target | None:
    """The next position item, over DO_ items and by the jumps; None makes the vehicle stop at the current one."""
    if brakes(context, items[seq], items[seq + 1 :]):
        return None
    for _ in items:
        following = jumps.resolve(items, seq + 1, counts=False)
        if following is None:
            return None
        seq, candidate = following, items[following]
        if candidate.command in TAKEOFF_COMMANDS:
            return None
        if candidate.has_position:
            return target_of(candidate, context.frame, context.home, context.params)
    return None


def brakes(context: NavContext, item: Item, following: Sequence[Item]) -> bool:
    """PX4's brake_for_hold: a hold time in rotary-wing state, or no autocontinue.

    Up to v1.15 also a gripper item right behind; since then its time-out never reaches the rule, because the item
    has no position.
    """
    if not item.autocontinue:
        return True
    if not context.hovers:
        return False
    if item.command == Cmd.NAV_WAYPOINT and item.param1 > 0.0:
        return True
    gripper_next = bool(following) and following[0].command in PAYLOAD_COMMANDS
    return context.profile.gripper_items_brake and gripper_next


CLIMB_TOLERANCE_M = 0.8
RAMPS_FROM = (SetpointKind.POSITION, SetpointKind.LOITER)


@dataclass(slots=True)
class MissionResult:
    """What the navigator publishes about the mission (mission_result)."""

    valid: bool = False
    finished: bool = False
    started: bool = False
    pauses: int = 0
    """How often mission mode was left before the end."""
    seq_current: int = 0
    seq_reached: int = -1


class MissionMode:
    """Executes the stored mission and writes `result`."""

    def __init__(self, context: NavContext, store: MissionStore, result: MissionResult, deployment: Deployment) -> None:
        self.result = result
        self.active = False
        self._context = context
        self._store = store
        self._deployment = deployment
        self._arrival = Arrival(context)
        self.jumps = JumpCounter()
        self._preparation = Preparation(context, self._arrival, self._report_reached)
        self._item_started_s = 0.0
        self._from_here = True
        """The next leg begins where the vehicle is, not at the last waypoint."""
        self._activated = False
        self._has_ended = False
        """After its last item PX4 has no current item; Return or Land mode does not change that."""
        self._pending_seq: int | None = None
        self._leg_home = context.home
        self._resolved: tuple[Item, Home, int, Target] | None = None

    # requests -----------------------------------------------------------------------------------------------

    def mission_changed(self) -> None:
        """A new mission is stored and was checked; in mission mode it is flown at once."""
        self.result.seq_current = self._store.current_seq
        self.result.seq_reached = -1
        self.result.finished = self._has_ended = False
        self.result.started = self.active
        self.result.pauses = 0
        self.jumps.reset()
        self._pending_seq = None
        if self.active and self.result.valid:
            self._restart()

    def set_current(self, seq: int, at_once: bool) -> bool:
        """MISSION_SET_CURRENT, or command 224, which outside mission mode waits for the entry into it."""
        if not 0 <= seq < len(self._store.mission):
            return False
        if self.active or at_once:
            self._go_to(seq)
            self.result.finished = False
            if self.active and self.result.valid:
                self._restart()
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
            self.jumps.reset()
        self._activated = True
        if self._has_ended and not context.state.status.landed:
            context.text(Severity.CRITICAL, "No valid mission available, loitering")
            context.event("mission_not_valid_loiter")
            self.result.finished = True
            return
        self.result.finished = False
        self.result.started = True
        if self.result.valid:
            context.text(Severity.INFO, "Executing Mission")
            context.event("mission_execute")
            self._restart()

    def deactivate(self) -> None:
        """Another mode was entered, or the vehicle disarmed."""
        if self.active:
            self._leave()
        self.active = False

    def _leave(self) -> None:
        context = self._context
        if not self.result.finished:
            self.result.pauses += 1
        context.command(PAUSE_CAMERA)
        if not context.state.status.landed:
            context.gimbal.start(context.now_s)

    def step(self) -> None:
        if not self.result.valid or self.result.finished:
            return
        item = self._item
        if self._preparation.busy:
            if self._preparation.step(item, self._target(item) if item.has_position else None):
                self._execute(item)
            return
        self._follow_home(item)
        if not self._completed(item):
            return
        self._report_reached()
        if item.autocontinue:
            self._advance()

    # the machine --------------------------------------------------------------------------------------------

    @property
    def _item(self) -> Item:
        return self._store.mission.items[self._store.current_seq]

    def _target(self, item: Item) -> Target:
        """Asked for in every cycle, and resolved again only when the item, home or a parameter has changed."""
        home, params = self._context.home, self._context.params
        known = self._resolved
        if known is None or known[0] is not item or known[1] is not home or known[2] != params.version:
            known = (item, home, params.version, target_of(item, self._context.frame, home, params))
            self._resolved = known
        return known[3]

    def _follow_home(self, item: Item) -> None:
        """The heights of a leg above home move with it (updateMissionAltAfterHomeChanged)."""
        before, self._leg_home = self._leg_home, self._context.home
        if item.has_position and item.is_relative and before is not self._leg_home:
            self._context.setpoint.raise_by(self._leg_home.up_m - before.up_m)

    def _go_to(self, seq: int) -> None:
        self._has_ended = False
        self._store.current_seq = seq
        self.result.seq_current = seq

    def _report_reached(self) -> None:
        self.result.seq_reached = self._store.current_seq

    def _advance(self) -> None:
        following = self.jumps.after(self._store.mission.items, self._store.current_seq)
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
        self.result.finished = self._has_ended = True
        context.end_there()
        if landed:
            context.setpoint.kind = SetpointKind.IDLE

    def _restart(self) -> None:
        """Start the current item out of the track."""
        self._from_here = True
        self._begin()

    def _begin(self) -> None:
        """Start the current item."""
        context = self._context
        resolved = self.jumps.resolve(self._store.mission.items, self._store.current_seq)
        if resolved is None:
            self._finish()
            return
        if resolved != self._store.current_seq:
            self._go_to(resolved)
        item = self._item
        self._item_started_s = context.now_s
        self._preparation.cancel()
        if item.has_position:
            waits = self._preparation.begin(item, self._target(item), from_here=self._from_here)
        else:
            towards = next_target(context, self._store.mission.items, self._store.current_seq, self.jumps)
            waits = self._preparation.begin_transition(item, towards)
        if not waits:
            self._execute(item)

    def _execute(self, item: Item) -> None:
        if item.has_position:
            self._fly(item, self._target(item))
            return
        if item.command == Cmd.NAV_RETURN_TO_LAUNCH:  # ends the mission in the same cycle
            self._report_reached()
            self._finish()
        if item.command == Cmd.DO_LAND_START:  # a marker, no command [10_plane_delivery]
            return
        if item.command == Cmd.NAV_DELAY:  # it holds here, and does not track ahead (setActiveMissionItems)
            self._context.setpoint.next = None
        if item.command == Cmd.DO_VTOL_TRANSITION:
            self._from_here = True  # the next leg is flown straight, not along its line [27_vtol_transitions]
        self._deployment.begin()
        self._context.command(as_issued((item.command, (item.param1, item.param2, item.param3, item.param4))))

    def _fly(self, item: Item, target: Target) -> None:
        context = self._context
        body = context.state.body
        self._arrival.start()
        self._leg_home = context.home
        kind, up_m = SetpointKind.POSITION, target.up_m
        if target.is_takeoff and (context.state.status.landed or body.on_ground):
            kind = SetpointKind.TAKEOFF
        elif target.is_landing:
            kind = SetpointKind.LAND
        elif target.is_loiter:
            kind = SetpointKind.LOITER
            if target.command == Cmd.NAV_LOITER_TO_ALT and context.flies_like_plane:
                up_m = max(body.up_m, target.up_m)
        ramps = context.flies_like_plane and not self._from_here and context.setpoint.kind in RAMPS_FROM
        came_from, came_from_up_m = (body.north_m, body.east_m), body.up_m
        after_takeoff = context.flies_like_plane and context.setpoint.kind is SetpointKind.TAKEOFF
        if kind is SetpointKind.POSITION and not self._from_here and not after_takeoff:  # control_auto_position
            came_from, came_from_up_m = context.setpoint.point, context.setpoint.up_m  # not where its turn began
        no_line = self._from_here and context.hovers
        self._from_here = False
        following = next_target(context, self._store.mission.items, self._store.current_seq, self.jumps)
        setpoint = context.set_point(
            kind,
            target.point,
            up_m,
            next_point=following.point if following is not None else None,
            previous=None if no_line else came_from,
            acceptance_radius_m=target.acceptance_radius_m,
        )
        setpoint.previous_up_m = came_from_up_m
        if ramps and kind is SetpointKind.POSITION:
            setpoint.ramp_to_m = self._arrival.switch_radius_m(target)
        setpoint.next_up_m = following.up_m if following is not None else up_m
        setpoint.next_lands = following is not None and following.is_landing
        setpoint.loiter_radius_m = target.loiter_radius_m
        setpoint.loiter_clockwise = target.loiter_clockwise
        distance_m = math.dist((body.north_m, body.east_m), target.point)
        if target.is_landing and distance_m > 1.0:
            setpoint.approach_slope = (body.up_m - target.up_m) / distance_m

    # completion ---------------------------------------------------------------------------------------------

    def _completed(self, item: Item) -> bool:
        context = self._context
        elapsed_s = context.now_s - self._item_started_s
        if item.has_position:
            return self._arrival.completed(self._target(item))
        if item.command == Cmd.NAV_DELAY:
            return elapsed_s >= item.param1
        if item.command in PAYLOAD_COMMANDS:
            return self._delivered(elapsed_s)
        if item.command == Cmd.DO_VTOL_TRANSITION:
            return context.state.status.vtol_state == int(item.param1) or not context.airframe.is_vtol
        return True

    def _delivered(self, elapsed_s: float) -> bool:
        """Since v1.16 a payload item ends after MIS_COMMAND_TOUT alone; before, also with the gripper's ack."""
        profile = self._context.profile
        timed_out = elapsed_s >= float(self._context.params[profile.command_timeout_param])
        if profile.gripper_items_wait_for_ack:
            return timed_out or self._deployment.succeeded
        return timed_out
