"""Expected errors between the parts of a cluster."""

from __future__ import annotations

from app.domain.errors import WaydropError


class BusDownError(WaydropError):
    """NATS cannot be reached, so nothing was sent."""

    code = "cluster.bus_down"


class GatewayUnreachableError(WaydropError):
    """No gateway answers for the vehicle, so nothing was done. The vehicle flies on."""

    code = "gateway.unreachable"


class NoReplyError(WaydropError):
    """The gateway may have carried out the request, and its answer was lost. The request is not repeated."""

    code = "gateway.no_reply"


class LeaseMovedError(WaydropError):
    """The lease is not as it was when it was read last, so it was not written."""

    code = "cluster.lease_moved"
