"""AUTO.LAND: down, here."""

from __future__ import annotations

from app.simulator.navigator.context import NavContext
from app.simulator.setpoint import SetpointKind


class LandMode:
    """Land at the present place; the commander disarms after COM_DISARM_LAND."""

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self.finished = False

    def activate(self) -> None:
        self.finished = False
        self._context.gimbal.start(self._context.now_s)
        self._context.set_point(SetpointKind.LAND, self._context.stop_point(), 0.0)

    def step(self) -> None:
        self.finished = self._context.state.status.landed
