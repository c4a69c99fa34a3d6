"""Loss of the offboard stream: COM_OBL_RC_ACT after COM_OF_LOSS_T [18_offboard_quad, 21_offboard_rover]."""

from __future__ import annotations

from app.simulator.commander import Commander, StatusOutput
from app.simulator.offboard.receiver import OffboardStream
from app.simulator.params import Params
from app.simulator.state import Status
from app.simulator.wire import Mode, Severity

ACTIONS = {0: Mode.POSCTL, 1: Mode.ALTCTL, 2: Mode.STABILIZED, 3: Mode.RTL, 4: Mode.LAND, 5: Mode.LOITER}
"""COM_OBL_RC_ACT. With nobody at the sticks the first three hold here."""
TERMINATE, DISARM = 6, 7
EVENT_NUMBERS = {0: 2, 1: 3, 2: 4, 3: 6, 4: 7, 5: 5, 6: 10, 7: 9}
"""COM_OBL_RC_ACT to failsafe_action_t, the event's second argument; hold and return are recorded."""


class OffboardLossFailsafe:
    """When a stream comes back the vehicle goes on in OFFBOARD by itself, also out of a return."""

    def __init__(
        self,
        status: Status,
        params: Params,
        commander: Commander,
        stream: OffboardStream,
        output: StatusOutput,
    ) -> None:
        self._status = status
        self._params = params
        self._commander = commander
        self._stream = stream
        self._text, self._event = output
        self._lost = False
        self._action = 0

    def boot(self) -> None:
        """Power-up."""
        self._lost = False

    def step(self) -> None:
        """One cycle. Only somebody who still intends OFFBOARD is concerned. A changed action is followed at once
        [18_offboard_quad, 20_offboard_plane].
        """
        if not self._status.armed or self._commander.intended is not Mode.OFFBOARD:
            self._lost = False
            return
        if self._lost and self._params.integer("COM_OBL_RC_ACT") != self._action:
            self._act()
        available = self._stream.is_seen and (self._stream.flies_blind or self._status.position_valid)
        if self._lost and available:
            self._lost = False
            self._commander.resume(Mode.OFFBOARD)
        elif not self._lost and not available:
            self._lost = True
            self._act()

    def _act(self) -> None:
        action = self._action = self._params.integer("COM_OBL_RC_ACT")
        self._text(Severity.CRITICAL, "Failsafe activated")
        mode = ACTIONS.get(action, Mode.LOITER)
        self._event("commander_failsafe_enter_generic", Mode.OFFBOARD, EVENT_NUMBERS.get(action, EVENT_NUMBERS[5]))
        if action == TERMINATE:
            self._commander.terminate()
        elif action == DISARM:
            self._commander.disarm_by_failsafe()
        else:
            self._commander.force_mode(mode)
