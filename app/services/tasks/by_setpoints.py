"""Tasks by setpoints: the guidance's word of this moment goes where the client's own setpoints go."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from app.domain.errors import SetpointRefusedError
from app.domain.offboard.state import OffboardState
from app.domain.setpoint.capability import FlightKind
from app.domain.setpoint.means import Means
from app.domain.tasks.course import Ground
from app.domain.tasks.guidance import CRUISE_M_S, Fix, Wish, stand, steer
from app.domain.tasks.turning import learnt_lag_s
from app.services.offboard.control import OffboardControl
from app.services.tasks.helm import Seen

HARMLESS: Final = frozenset({"limit.speed", "limit.climb", "limit.descend"})
"""What may be clamped of a task: it takes longer. Any other clamp leads somewhere else, so the task stops."""
SLOWER: Final = (1.0, 0.5, 0.25, 0.125)
STOPS_IN_S: Final = 1.0
"""A vehicle that is to stand is told the place where it can."""


class BySetpoints:
    """See Helm."""

    means: Final = Means.SETPOINTS

    def __init__(self, control: OffboardControl) -> None:
        self._control = control
        self._stands: tuple[Ground, float] | None = None
        self._lag_s = 0.0

    def begin(self) -> None:
        """See Helm. Another circle has another lag."""
        self._stands, self._lag_s = None, 0.0

    def stand(self, kind: FlightKind, fix: Fix) -> None:
        """At the place chosen before, else where it can stop; if that is refused, as at a fence, where it is now.

        Raises:
            SetpointRefusedError: even there; the next tick tries anew.
        """
        chosen, self._stands = self._stands, None
        refused = None
        for place in (chosen, (fix.ahead(STOPS_IN_S).ground, fix.up_m), (fix.ground, fix.up_m)):
            if place is None:
                continue
            try:
                self._control.steer(stand(kind, *place, fix))
            except SetpointRefusedError as error:
                refused = error
            else:
                self._stands = place
                return
        if refused is not None:
            raise refused

    def fly(self, wish: Wish, kind: FlightKind, fix: Fix, seconds: float) -> Seen:
        """As fast as asked, or slower where a velocity would soon lead out of the fence or a limit.

        Raises:
            SetpointRefusedError: it leads there however slow it is, or cannot be slower.
        """
        speed = wish.speed_m_s or CRUISE_M_S[kind]
        if kind is FlightKind.ROTARY and self._control.state is OffboardState.ACTIVE:
            self._lag_s = learnt_lag_s(self._lag_s, wish.course, fix.ground, fix.velocity, speed, seconds)
        for share in (1.0,) if kind is FlightKind.WING else SLOWER:
            seen = steer(kind, replace(wish, speed_m_s=speed * share), fix, self._lag_s)
            try:
                beyond = [clamp for clamp in self._control.steer(seen.setpoint) if clamp.code not in HARMLESS]
            except SetpointRefusedError as refused:
                error = refused
                continue
            if not beyond:
                return Seen(seen.reference, seen.arrived)
            error = SetpointRefusedError(beyond[0].detail, refusal=beyond[0].code)
        raise error
