"""DO_GRIPPER and DO_WINCH from a ground station to the autopilot."""

from __future__ import annotations

from app.simulator.commands.link import CommandLink, Handler, Request
from app.simulator.payload import PayloadDeliverer
from app.simulator.wire import Cmd


class PayloadCommands:
    """Handlers for the command link; the acks come from the deliverer, in its own time.

    PX4's commander leaves both commands to other parts of the system: where none executes them nobody answers.
    """

    def __init__(self, payload: PayloadDeliverer | None) -> None:
        self._payload = payload
        self._link: CommandLink | None = None

    def connect(self, link: CommandLink) -> None:
        """Give the way back for acks."""
        self._link = link

    def handlers(self) -> dict[int, Handler]:
        """Command number to handler."""
        return {Cmd.DO_GRIPPER: self._gripper, Cmd.DO_WINCH: lambda request: None}

    def _gripper(self, request: Request) -> None:
        link = self._link
        if self._payload is None:
            return
        assert link is not None
        self._payload.command(request.param2, lambda result: link.ack(request, result))
