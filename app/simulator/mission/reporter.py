"""MISSION_CURRENT and MISSION_ITEM_REACHED, as PX4's mission manager sends them: in slots of one second.

It looks at the navigator's result at every poll, not at every cycle: an item that is current for one cycle only may
never be seen, as on the real vehicle.
"""

from __future__ import annotations

from app.simulator.channel import Radio
from app.simulator.clock import VehicleClock
from app.simulator.dialect import mavlink
from app.simulator.firmware import FirmwareProfile
from app.simulator.mission.store import MissionStore
from app.simulator.navigator.mission_mode import MissionResult
from app.simulator.state import Status
from app.simulator.wire import MissionState, Mode

SLOT_S = 1.0
REPEATS = 10
NO_MISSION_TOTAL = 65535
MODE_IN_MISSION, MODE_SUSPENDED = 1, 2


class MissionReporter:
    """Reports progress to everybody."""

    def __init__(
        self,
        result: MissionResult,
        store: MissionStore,
        status: Status,
        radio: Radio,
        clock: VehicleClock,
        profile: FirmwareProfile,
    ) -> None:
        self._result = result
        self._store = store
        self._status = status
        self._radio = radio
        self._clock = clock
        self._profile = profile
        self._slot_s = SLOT_S
        self._reached = -1
        self._repeats = 0
        self._was_finished = False

    def boot(self) -> None:
        """Power-up."""
        self._slot_s = SLOT_S
        self._reached = -1
        self._was_finished = False

    def poll(self) -> None:
        """Send what is new or due."""
        if self._result.seq_reached != self._reached:
            self._reached = self._result.seq_reached
            self._repeats = 0
            if self._reached >= 0:
                self._send_reached()
        if self._result.finished != self._was_finished:
            self._was_finished = self._result.finished
            self._send_current()
        if self._clock.now_s < self._slot_s:
            return
        self._slot_s = max(self._slot_s + SLOT_S, self._clock.now_s)
        self._send_current()
        if self._reached >= 0 and self._repeats < REPEATS:
            self._repeats += 1
            self._send_reached()

    @property
    def mission_state(self) -> MissionState:
        if not self._profile.reports_mission_ids:
            return MissionState.UNKNOWN
        result = self._result
        if not result.valid or not len(self._store.mission):
            return MissionState.NO_MISSION
        if result.finished:
            return MissionState.COMPLETE
        if self._in_mission:
            return MissionState.ACTIVE  # disarmed too [14_infeasible_quad, 26_offboard_then_return]
        if not result.started or result.seq_current == 0:
            return MissionState.NOT_STARTED
        # a second pause of the same mission is not shown as one [16_pause_resume_jump, 24_link_loss]
        return MissionState.PAUSED if result.pauses <= 1 else MissionState.ACTIVE

    @property
    def _in_mission(self) -> bool:
        """Takeoff and land mode count as mission modes [22_reposition_quad, 25_land_detector_quad]."""
        return self._status.mode in (Mode.MISSION, Mode.TAKEOFF, Mode.LAND)

    def _send_reached(self) -> None:
        self._radio.broadcast(mavlink.MAVLink_mission_item_reached_message(self._reached))

    def _send_current(self) -> None:
        total = len(self._store.mission)
        ids = (self._store.mission.plan_id, self._store.fence.plan_id, self._store.rally.plan_id)
        message = mavlink.MAVLink_mission_current_message(
            self._result.seq_current,
            total or NO_MISSION_TOTAL,
            self.mission_state,
            (MODE_IN_MISSION if self._in_mission else MODE_SUSPENDED) if self._profile.reports_mission_ids else 0,
            *(ids if self._profile.reports_mission_ids else (0, 0, 0)),
        )
        self._radio.broadcast(message)
