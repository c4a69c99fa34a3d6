"""Whether a return now goes to a rally point, and to which: the vehicle chooses as Return mode begins.

As PX4 does in rtl.cpp (setRtlTypeAndDestination, findRtlDestination): what is not home must be nearer by 2 m, and a
rally point within 10 m of home is none, but where rally points alone are chosen from. A VTOL on its wing may pass over
places without landing approaches: whether there are some is not known here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from pydantic import BaseModel, ConfigDict

from app.domain.autopilot.base import RallyReturn, Return
from app.domain.errors import ConflictError, DivertRefusedError
from app.domain.geo import distance_m
from app.domain.reasons import Param, Reason, ReasonCode
from app.domain.vehicle.state import VehicleState, VehicleType, VtolState

FRESH_POSITION_S: Final = 2.0
NEARER_M: Final = 2.0
AT_HOME_M: Final = 10.0
NEARLY_M: Final = 20.0
"""Where the vehicle is as it chooses is not known better."""
CHOOSES_WITHIN_S: Final = FRESH_POSITION_S + 3.0
"""The position may be so old by then: as it is looked at, and three tries of the command, a second each."""
Place = tuple[float, float]
"""Latitude and longitude in degrees."""


class RallyDestination(BaseModel):
    """The rally point to which a vehicle returns; PX4 does not report it, so this is what its rules give.

    `index` is that in the plan's `rally_points`, `or_index` are others that were nearly as near. `distance_m` is from
    where it was told. `lands` false: it stays in the air there (RTL_LAND_DELAY below 0); null: it does not tell.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    index: int
    latitude_deg: float
    longitude_deg: float
    distance_m: float
    or_index: tuple[int, ...] = ()
    lands: bool | None
    reason: Reason


@dataclass(frozen=True, slots=True)
class ReturnSight:
    """What the choice rests on: the rally points and landings on board, and how the vehicle is set now."""

    vehicle_type: VehicleType
    state: VehicleState
    rally: Sequence[Place]
    landings: Sequence[Place]
    returns: Return
    there: RallyReturn

    def destination(self) -> RallyDestination:
        """Where a return ordered now goes. Raises DivertRefusedError, ConflictError: position or home is not known."""
        if not self.rally:
            raise _refused(
                "divert.no_rally_points", "there are no rally points on the vehicle", "return, or change the plan"
            )
        if not self.returns.choice:
            why = f"with {self.returns.setting} it returns along its mission, to no rally point"
            raise _refused("divert.return_type", why, self._hint)
        over = self.there.passes_over
        if self.vehicle_type is VehicleType.VTOL and over is not None:
            why = f"with {over} a VTOL on its wing passes over rally points"
            raise _refused("divert.approach_forced", f"{why} without landing approaches", f"return, or {over.mend}")
        here, reach_m = self._here(), self._reach_m()
        points = [(index, distance_m(*here, *place)) for index, place in enumerate(self.rally) if self._counts(place)]
        if not points:
            raise _refused("divert.no_rally_points", "all rally points are at home: a return goes home", self._hint)
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
        told: dict[str, Param] = {"rally_point": index + 1, "distance_m": away_m}
        how: dict[str, Param] = {"choice": self.returns.choice, "setting": str(self.returns.setting)}
        reason = Reason.of(ReasonCode.RALLY_POINT, **told, **how)
        if near:
            others = " or ".join(str(other + 1) for other in near)
            reason = Reason.of(ReasonCode.RALLY_POINT_OR, **told, **how, others=others)
        if self.there.lands is False:
            reason = Reason.of(ReasonCode.RALLY_STAYS_IN_AIR, reason, setting=str(self.there.lands_by))
        return reason

    def _refuse_other(self, name: str, other_m: float, index: int, away_m: float, reach_m: float) -> DivertRefusedError:
        where = f"{name} is {other_m:.0f} m away and rally point {index + 1} {away_m:.0f} m"
        if other_m + reach_m < away_m:
            why = f"it would return there: with {self.returns.setting} to {self.returns.choice}"
            return _refused("divert.other_is_nearer", f"{where}: {why}", self._hint)
        return _refused("divert.too_close", f"{where}: which of them it would choose is not sure", self._hint)

    @property
    def _hint(self) -> str:
        alone = self.returns.rally_alone
        return f"return, or change the plan to land there; {alone} it goes to the nearest rally point"

    def _here(self) -> Place:
        state = self.state
        fresh = state.position_age_s is not None and state.position_age_s <= FRESH_POSITION_S
        if not fresh or state.latitude_deg is None or state.longitude_deg is None:
            raise ConflictError("the vehicle's position is not known", hint="wait until it is heard again, or return")
        return state.latitude_deg, state.longitude_deg

    def _reach_m(self) -> float:
        """By so much one distance may have grown against another until it chooses."""
        return max(NEARLY_M, 2.0 * CHOOSES_WITHIN_S * (self.state.ground_speed_m_s or 0.0))

    def _counts(self, place: Place) -> bool:
        is_alone = not (self.returns.to_home or self.returns.to_landing)
        return is_alone or distance_m(*place, *self._home()) > AT_HOME_M

    def _home(self) -> Place:
        home = self.state.home
        if home is None:
            raise ConflictError("the vehicle's home is not known", hint="wait until it tells it, or return")
        return home.latitude_deg, home.longitude_deg

    def _others(self) -> Iterator[tuple[str, Place]]:
        """Where a return may go instead."""
        hovering_vtol = self.vehicle_type is VehicleType.VTOL and self.state.vtol_state is not VtolState.FIXED_WING
        if self.returns.to_home or (self.returns.to_landing and hovering_vtol):
            yield "home", self._home()
        if self.returns.to_landing:
            for landing in self.landings:
                yield "the mission's landing", landing


def _refused(refusal: str, detail: str, hint: str) -> DivertRefusedError:
    return DivertRefusedError(detail, hint=hint, refusal=refusal)
