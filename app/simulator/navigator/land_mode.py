"""AUTO.LAND: down, here; without a position (PX4's Descend) down wherever it drifts."""

from __future__ import annotations

from app.simulator.navigator.context import NavContext
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, VtolState


class LandMode:
    """Land at the present place; the commander disarms after COM_DISARM_LAND."""

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self.finished = False
        self._blind = False

    def activate(self) -> None:
        self.finished = False
        self._context.gimbal.start(self._context.now_s)
        self._begin()

    def _begin(self) -> None:
        context = self._context
        self._blind = not context.state.status.position_valid
        if not self._blind:
            context.set_point(SetpointKind.LAND, context.stop_point(), 0.0)
            return
        body = context.state.body
        context.set_point(SetpointKind.DESCEND, (body.north_m, body.east_m), 0.0)
        if context.airframe.is_vtol and context.flies_like_plane:  # NAV_FORCE_VT
            context.command((Cmd.DO_VTOL_TRANSITION, (float(VtolState.MC), 0.0, 0.0, 0.0)))

    def step(self) -> None:
        if self._blind is self._context.state.status.position_valid:
            self._begin()
        self.finished = self._context.state.status.landed
