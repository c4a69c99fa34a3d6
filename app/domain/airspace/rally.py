"""Whether a return would go to a rally point, and to which one. The vehicle chooses when Return mode begins.

Follows PX4's rtl.cpp (setRtlTypeAndDestination, findRtlDestination): another destination must be 2 m nearer than home,
and rally points within 10 m of home are ignored unless only rally points are eligible. A VTOL in fixed-wing flight may
skip destinations without landing approaches, which Waydrop cannot know.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from app.domain.autopilot.base import RallyReturn, Return
from app.domain.errors import ConflictError, DivertRefusedError
from app.domain.geo import distance_m
from app.domain.model import FrozenForm
from app.domain.reasons import Param, Reason, ReasonCode
from app.domain.vehicle.state import VehicleState, VehicleType, VtolState

FRESH_POSITION_S: Final = 2.0
NEARER_M: Final = 2.0
AT_HOME_M: Final = 10.0
NEARLY_M: Final = 20.0
"""Uncertainty of the vehicle's position when it chooses."""
CHOOSES_WITHIN_S: Final = FRESH_POSITION_S + 3.0
"""Maximum age of the position by then: its age when read, and three attempts of the command, one second each."""
Place = tuple[float, float]
"""Latitude and longitude in degrees."""


class RallyDestination(FrozenForm):
    """The predicted rally point of a return. PX4 does not report it, so this follows from PX4's rules.

    `index` is its index in the plan's `rally_points`, `or_index` are others that were nearly as near. `distance_m` is
    measured at the time of the command. `lands` false: the vehicle does not land there (RTL_LAND_DELAY below 0); null:
    unknown.
    """

    index: int
    latitude_deg: float
    longitude_deg: float
    distance_m: float
    or_index: tuple[int, ...] = ()
    lands: bool | None
    reason: Reason


@dataclass(frozen=True, slots=True)
class ReturnConditions:
    """What the choice rests on: the rally points and landings on board, and how the vehicle is set now."""

    vehicle_type: VehicleType
    state: VehicleState
    rally: Sequence[Place]
    landings: Sequence[Place]
    returns: Return
    there: RallyReturn

    def destination(self) -> RallyDestination:
        """Predict where a return goes. Raises DivertRefusedError, or ConflictError if position or home is unknown."""
        if not self.rally:
            raise _refused(
                "divert.no_rally_points", "the vehicle has no rally points", "use return, or change the plan"
            )
        if not self.returns.choice:
            why = f"with {self.returns.setting}, a return follows the mission and goes to no rally point"
            raise _refused("divert.return_type", why, self._hint)
        over = self.there.passes_over
        if self.vehicle_type is VehicleType.VTOL and over is not None:
            why = f"with {over}, a VTOL in fixed-wing flight may skip rally points"
            raise _refused(
                "divert.approach_forced", f"{why} without landing approaches", f"use return, or {over.remedy}"
            )
        here, reach_m = self._here(), self._reach_m()
        points = [(index, distance_m(*here, *place)) for index, place in enumerate(self.rally) if self._counts(place)]
        if not points:
            raise _refused("divert.no_rally_points", "all rally points are at home, so a return goes home", self._hint)
        index, away_m = min(points, key=lambda point: point[1])
        for name, place in self._others():
            other_m = distance_m(*here, *place)
            if other_m <= away_m + NEARER_M + reach_m:
                raise self._refuse_other(name, other_m, index, away_m, reach_m)
        near = tuple(i for i, m in points if i != index and m <= away_m + NEARER_M + reach_m)
        return RallyDestination(
            index=index,
            latitude_deg=self.rally[index][0],
            longitude_deg=self.rally[index][1],
            distance_m=away_m,
            or_index=near,
            lands=self.there.lands,
            reason=self._reason(index, away_m, near),
        )

    def _reason(self, index: int, away_m: float, near: Sequence[int]) -> Reason:
        which: dict[str, Param] = {"rally_point": index + 1, "distance_m": away_m}
        how: dict[str, Param] = {"choice": self.returns.choice, "setting": str(self.returns.setting)}
        reason = Reason.of(ReasonCode.RALLY_POINT, **which, **how)
        if near:
            others = " or ".join(str(other + 1) for other in near)
            reason = Reason.of(ReasonCode.RALLY_POINT_OR, **which, **how, others=others)
        if self.there.lands is False:
            reason = Reason.of(ReasonCode.RALLY_STAYS_IN_AIR, reason, setting=str(self.there.lands_by))
        return reason

    def _refuse_other(self, name: str, other_m: float, index: int, away_m: float, reach_m: float) -> DivertRefusedError:
        where = f"{name} is {other_m:.0f} m away, rally point {index + 1} is {away_m:.0f} m away"
        if other_m + reach_m < away_m:
            why = f"with {self.returns.setting}, a return would go to {self.returns.choice}"
            return _refused("divert.other_is_nearer", f"{where}: {why}", self._hint)
        return _refused("divert.too_close", f"{where}: the choice is too close to predict", self._hint)

    @property
    def _hint(self) -> str:
        alone = self.returns.rally_alone
        return f"use return, or change the plan to land there; {alone} a return goes to the nearest rally point"

    def _here(self) -> Place:
        state = self.state
        fresh = state.position_age_s is not None and state.position_age_s <= FRESH_POSITION_S
        if not fresh or state.latitude_deg is None or state.longitude_deg is None:
            raise ConflictError("the vehicle's position is unknown", hint="wait for telemetry, or use return")
        return state.latitude_deg, state.longitude_deg

    def _reach_m(self) -> float:
        """How much one distance may change relative to another before the vehicle chooses."""
        return max(NEARLY_M, 2.0 * CHOOSES_WITHIN_S * (self.state.ground_speed_m_s or 0.0))

    def _counts(self, place: Place) -> bool:
        is_alone = not (self.returns.to_home or self.returns.to_landing)
        return is_alone or distance_m(*place, *self._home()) > AT_HOME_M

    def _home(self) -> Place:
        home = self.state.home
        if home is None:
            raise ConflictError(
                "the vehicle's home is unknown", hint="wait until the vehicle reports it, or use return"
            )
        return home.latitude_deg, home.longitude_deg

    def _others(self) -> Iterator[tuple[str, Place]]:
        """Possible destinations other than rally points."""
        hovering_vtol = self.vehicle_type is VehicleType.VTOL and self.state.vtol_state is not VtolState.FIXED_WING
        if self.returns.to_home or (self.returns.to_landing and hovering_vtol):
            yield "home", self._home()
        if self.returns.to_landing:
            for landing in self.landings:
                yield "the mission landing", landing


def _refused(refusal: str, detail: str, hint: str) -> DivertRefusedError:
    return DivertRefusedError(detail, hint=hint, refusal=refusal)
