"""Tasks by commands: a wing in Hold is told where to fly and what to circle, each order measured before."""

from __future__ import annotations

from typing import Final

from app.domain.errors import LeaseLostError, SetpointRefusedError
from app.domain.setpoint.capability import FlightKind
from app.domain.setpoint.forms import PositionNed
from app.domain.setpoint.limiter import limit
from app.domain.setpoint.means import Means
from app.domain.tasks.commanded import CircleAt, FlyTo, Order, Wing, order
from app.domain.tasks.guidance import Fix, Wish
from app.domain.tasks.order_request import order_request
from app.domain.tasks.origin import EkfOrigin
from app.domain.tasks.room import circle_around, refuse_outside
from app.services.offboard.control import OffboardControl
from app.services.tasks.helm import Seen

STOPS_IN_S: Final = 1.0


class ByCommands:
    """See Helm. `origin`: from where the orders' metres count."""

    means: Final = Means.COMMANDS

    def __init__(self, control: OffboardControl, origin: EkfOrigin) -> None:
        self._control = control
        self._origin = origin
        self._order: Order | None = None
        self._stands = False

    def begin(self) -> None:
        """See Helm. What the vehicle refused may be asked for again."""
        self._stands, self._control.orders.refused = False, ""

    def stand(self, kind: FlightKind, fix: Fix) -> None:
        """Circle the place where it was told to: what holds already is not measured again, a refusal is asked anew."""
        if not self._stands or self._order is None:
            place = fix.ahead(STOPS_IN_S)
            self._want(FlyTo(place.ground, fix.up_m))
            self._stands = True
        else:
            self._control.orders.ask_again()
            self._repeat(self._order)

    def fly(self, wish: Wish, kind: FlightKind, fix: Fix, seconds: float) -> Seen:
        """The order of this moment. Raises SetpointRefusedError: beyond a limit, or the vehicle refused the last."""
        if self._control.orders.refused:
            raise SetpointRefusedError(self._control.orders.refused, refusal="vehicle.refused")
        before, self._stands = self._order, False
        found = order(wish, fix, self._wing, before)
        if found.order == before:
            self._repeat(found.order)
        else:
            self._want(found.order)
        return Seen(found.reference, found.arrived)

    @property
    def _wing(self) -> Wing:
        surroundings = self._control.surroundings
        if surroundings is None:
            raise LeaseLostError("the lease has ended")
        return surroundings.wing

    def _want(self, wanted: Order) -> None:
        self._refuse_beyond(wanted)
        self._order = wanted
        self._repeat(wanted)

    def _repeat(self, wanted: Order) -> None:
        self._control.orders.want(order_request(wanted, self._origin))

    def _refuse_beyond(self, wanted: Order) -> None:
        """The straight way there, and the circle around it, where it stays if nobody says anything more."""
        control, surroundings = self._control, self._control.surroundings
        if surroundings is None:
            raise LeaseLostError("the lease has ended")
        limits = control.settings.limits.model_copy(update={"beyond": "refuse"})
        where = surroundings.whereabouts(control.link.state())
        if isinstance(wanted, CircleAt):
            center, radius_m = wanted.center, abs(wanted.radius_m)
        else:
            center, radius_m = wanted.ground, surroundings.wing.loiter_m
        place = PositionNed(type="position_ned", north_m=center[0], east_m=center[1], down_m=-wanted.up_m)
        limit(place, limits, where)
        refuse_outside(circle_around(center, radius_m), wanted.up_m, limits, where)
