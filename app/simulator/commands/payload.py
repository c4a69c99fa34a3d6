"""DO_GRIPPER from a ground station."""

from __future__ import annotations

from app.simulator.commands.link import CommandLink, Handler, Request
from app.simulator.payload import PayloadDeliverer
from app.simulator.wire import Cmd


class PayloadCommands:
    """Handlers for the command link; the acks come from the deliverer, in its own time."""

    def __init__(self, payload: PayloadDeliverer) -> None:
        self._payload = payload
        self._link: CommandLink | None = None

    def connect(self, link: CommandLink) -> None:
        """Give the way back for acks."""
        self._link = link

    def handlers(self) -> dict[int, Handler]:
        """Command number to handler."""
        return {Cmd.DO_GRIPPER: self._gripper}

    def _gripper(self, request: Request) -> None:
        link = self._link
        assert link is not None
        self._payload.command(request.param2, lambda result: link.ack(request, result))
