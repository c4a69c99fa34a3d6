"""What PX4's navigator says to cameras and gimbals when it leaves a mission, returns or lands; nothing here has one."""

from __future__ import annotations

import math

from app.simulator.wire import VEHICLE_COMPONENT, Cmd

Command = tuple[int, tuple[float, ...]]
"""A vehicle command's number and its first parameters, the others are 0."""

NEUTRAL_AFTER_S = 0.25
"""So that a flight task can give the gimbal back first (neutralize_gimbal_if_control_activated)."""
PAUSE_CAMERA: Command = (Cmd.DO_TRIGGER_CONTROL, (-1.0, 0.0, 1.0, 0.0))
SET_NEUTRAL: Command = (Cmd.DO_GIMBAL_MANAGER_PITCHYAW, (math.nan, math.nan, math.nan, math.nan, 2.0))
RELEASE_CONTROL: Command = (Cmd.DO_GIMBAL_MANAGER_CONFIGURE, (-3.0, -3.0, -1.0, -1.0))
SENT_ONCE = (SET_NEUTRAL, RELEASE_CONTROL)
"""Published in the same microsecond as the one before, PX4's sender takes them for that one's repeats."""


def as_issued(command: Command) -> Command:
    """A mission item's command as it leaves the navigator: one single picture is a shot of DO_DIGICAM_CONTROL."""
    number, params = command
    if number == Cmd.IMAGE_START_CAPTURE and len(params) > 2 and params[2] == 1.0:
        return Cmd.DO_DIGICAM_CONTROL, (0.0, 0.0, 0.0, 0.0, 1.0)
    return command


class GimbalTimer:
    """Turns the gimbal to neutral a moment after it was asked to; asked again meanwhile, the moment stays."""

    def __init__(self, system_id: int) -> None:
        configure = (float(system_id), float(VEHICLE_COMPONENT), -1.0, -1.0)
        self._commands = ((Cmd.DO_GIMBAL_MANAGER_CONFIGURE, configure), SET_NEUTRAL, RELEASE_CONTROL)
        self._due_s = math.inf

    def start(self, now_s: float) -> None:
        """The vehicle returns, lands, or leaves a mission in the air."""
        self._due_s = min(self._due_s, now_s + NEUTRAL_AFTER_S)

    def boot(self) -> None:
        """Nothing is asked for."""
        self._due_s = math.inf

    def due(self, now_s: float) -> tuple[Command, ...]:
        if now_s <= self._due_s:
            return ()
        self._due_s = math.inf
        return self._commands
