"""Which vehicle gets a job: what speaks against each, how well each fits, and the choice among them."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from app.domain.autopilot import autopilot
from app.domain.geo import distance_m
from app.domain.jobs.job import Candidate, Refusal, VehicleRefusal, VehicleSelector
from app.domain.plan import Plan
from app.domain.reasons import Reason, ReasonCode
from app.domain.validation.finding import Finding, Severity
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.state import LandedState, VehicleState


@dataclass(frozen=True, slots=True)
class VehicleReadiness:
    """One vehicle as seen by the queue. `held_by`: the run or job that uses it. `stopped`: why its queue is stopped.

    `no_new_work`: why nothing new may begin with any vehicle of the gateway.
    """

    vehicle_id: str
    state: VehicleState
    quarantined: Reason | None = None
    held_by: str | None = None
    lease_holder: str | None = None
    stopped: Reason | None = None
    no_new_work: str | None = None


def why_not_ready(vehicle: VehicleReadiness) -> tuple[Refusal, ...]:
    """Return all reasons; none: landed, disarmed, connected, free. Unknown facts count as reasons."""
    return tuple(_reasons(vehicle))


def why_unseen(stopped: Reason | None = None) -> tuple[Refusal, ...]:
    """Return what is known of a vehicle that never connected. `stopped`: why its queue is stopped."""
    message = "the vehicle has not connected since Waydrop started"
    unknown = _refusal(VehicleRefusal.UNKNOWN, message, "list the vehicles to see their IDs")
    return (unknown,) if stopped is None else (unknown, _queue_stopped(stopped))


def why_not_selected(vehicle_id: str, battery_percent: float | None, selector: VehicleSelector) -> tuple[Refusal, ...]:
    """Return the requirements of the job that the vehicle does not meet."""
    return tuple(_not_selected(vehicle_id, battery_percent, selector))


def why_not_trusted(vehicle: VehicleReadiness, fleet: Iterable[VehicleReadiness]) -> tuple[Refusal, ...]:
    """Why Waydrop itself does not choose this vehicle: anybody may add one that does not exist to an unsigned link."""
    others_sign = any(other.state.link_security is LinkSecurity.SIGNED for other in fleet)
    if vehicle.state.link_security is LinkSecurity.SIGNED or not others_sign:
        return ()
    message = "its messages are not signed, and those of other vehicles are: it may be forged"
    return (_refusal(VehicleRefusal.UNSIGNED, message, "give it a key, or name it in the job"),)


def _reasons(vehicle: VehicleReadiness) -> Iterator[Refusal]:
    state = vehicle.state
    if vehicle.no_new_work is not None:
        yield _refusal(VehicleRefusal.SITE_NOT_HELD, vehicle.no_new_work, "give each gateway its own site")
    if vehicle.quarantined is not None:
        hint = f"give each vehicle its own {autopilot().system_id_name}: the quarantine ends when one of them is silent"
        yield _refusal(VehicleRefusal.QUARANTINED, "it is quarantined: two vehicles have its system id", hint)
    if not state.connected:
        yield _refusal(VehicleRefusal.DISCONNECTED, "its link is lost", "check its power and its link")
    if vehicle.held_by is not None:
        yield _refusal(VehicleRefusal.BUSY, f"it has {vehicle.held_by}", "wait until that is over")
    if vehicle.lease_holder is not None:
        yield _refusal(
            VehicleRefusal.LEASED, f"{vehicle.lease_holder} has its offboard lease", "wait until it is released"
        )
    if state.armed is not False:
        message = "it is armed" if state.armed else "it does not report whether it is armed"
        yield _refusal(VehicleRefusal.ARMED, message, "wait until it is disarmed")
    if state.landed is not LandedState.ON_GROUND:
        message = f"it is not known to be on the ground (landed: {state.landed.value})"
        yield _refusal(VehicleRefusal.NOT_LANDED, message, "wait until it has landed")
    if state.may_be_in_failsafe:
        yield _refusal(
            VehicleRefusal.IN_FAILSAFE, "it is, or may be, in a failsafe", "resolve the cause of the failsafe"
        )
    if vehicle.stopped is not None:
        yield _queue_stopped(vehicle.stopped)


def _queue_stopped(why: Reason) -> Refusal:
    hint = "check the vehicle, then resume its job queue"
    refusal = _refusal(VehicleRefusal.QUEUE_STOPPED, "its queue is stopped", hint)
    return refusal.model_copy(update={"reason": why})


def _not_selected(vehicle_id: str, battery_percent: float | None, selector: VehicleSelector) -> Iterator[Refusal]:
    if not selector.allows(vehicle_id):
        message = f"the job names {', '.join(selector.named)}"
        refusal = _refusal(VehicleRefusal.NOT_ALLOWED, message, "queue another job for this vehicle")
        yield refusal.model_copy(update={"permanent": True})
    least = selector.min_battery_percent
    if least > 0 and battery_percent is None:
        hint = "min_battery_percent 0 takes a vehicle that does not report it"
        yield _refusal(VehicleRefusal.BATTERY_UNKNOWN, "it does not report its battery", hint)
    elif battery_percent is not None and battery_percent < least:
        message = f"its battery has {battery_percent:.0f} %, the job asks for {least:g} %"
        yield _refusal(VehicleRefusal.BATTERY_LOW, message, "charge it, or ask for less")


def _refusal(code: VehicleRefusal, message: str, hint: str) -> Refusal:
    return Refusal(code=code.value, message=message, hint=hint)


NOBODY_READS: Final = frozenset({"vehicle.home_differs"})
"""Warnings that a person may accept for a named vehicle. If Waydrop chooses the vehicle, they count as refusals."""


_PASSING: Final = frozenset({"vehicle.home_unknown", "vehicle.home_differs", "vehicle.clock_too_fast"})
"""What stands against a vehicle now and may be otherwise in a moment, or where it lands next."""


def why_unfit(findings: Iterable[Finding], *, we_choose: bool, at_best: Collection[str] = ()) -> tuple[Refusal, ...]:
    """The findings that stand against a vehicle.

    `at_best` are the codes of the errors that stay with a full battery where the plan begins: those are permanent.
    """
    return tuple(
        Refusal(
            code=found.code,
            message=found.message,
            hint=found.hint,
            pointer=found.pointer,
            permanent=found.code in at_best and found.code not in _PASSING,
        )
        for found in findings
        if found.severity is Severity.ERROR or (we_choose and found.code in NOBODY_READS)
    )


def beginning_of(plan: Plan) -> tuple[float, float] | None:
    """Where the plan begins, in degrees: its home, else its first place. None: wherever the vehicle is."""
    if plan.home is not None:
        return plan.home.latitude_deg, plan.home.longitude_deg
    point = next((point for item in plan.items if (point := item.point()) is not None), None)
    return None if point is None else (point.latitude_deg, point.longitude_deg)


def distance_to(beginning: tuple[float, float] | None, state: VehicleState) -> float | None:
    """Distance over ground from the vehicle in metres; None if either position is unknown."""
    if beginning is None or state.latitude_deg is None or state.longitude_deg is None:
        return None
    return round(distance_m(state.latitude_deg, state.longitude_deg, *beginning), 1)


# Chooses among the vehicles that can: the nearest, then the one with most battery, then by id. Always the same.


NEAR_M: Final = 10.0
"""A vehicle at most this much farther than the nearest counts as equally near; battery decides between them."""

MAX_NAMED: Final = 5
"""Vehicles that a warning names; the candidates have them all."""


def choose(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """The candidates in the order of their ids, at most one of them chosen, each that can with a reason."""
    able = [one for one in candidates if one.can]
    best = best_of(able) if able else None
    listed = (one if not one.can or best is None else _explained(one, best, alone=len(able) == 1) for one in candidates)
    return tuple(sorted(listed, key=lambda one: by_number(one.vehicle_id)))


def chosen_of(candidates: Sequence[Candidate]) -> Candidate | None:
    return next((one for one in candidates if one.chosen), None)


def hopeless(candidates: Sequence[Candidate]) -> str:
    """Why waiting alone gives the job to none of these vehicles; empty if it may, or if there are none."""
    if not candidates or not all(one.permanent for one in candidates):
        return ""
    named = [f"{one.vehicle_id}: {_lasting(one)}" for one in candidates[:MAX_NAMED]]
    others = [f"and {len(candidates) - MAX_NAMED} more"] if len(candidates) > MAX_NAMED else []
    return f"no vehicle can fly it as it is, and waiting does not change that ({'; '.join([*named, *others])})"


def by_number(vehicle_id: str) -> tuple[int, str]:
    """v2 before v10."""
    return len(vehicle_id), vehicle_id


def best_of(able: Sequence[Candidate]) -> Candidate:
    nearest_m = min(_metres(one) for one in able)
    near = [one for one in able if _metres(one) <= nearest_m + NEAR_M]
    return min(near, key=lambda one: (-_percent(one), by_number(one.vehicle_id)))


def _explained(one: Candidate, best: Candidate, *, alone: bool) -> Candidate:
    if one is best:
        why = Reason.of(ReasonCode.ONLY_CANDIDATE if alone else ReasonCode.CHOSEN)
        return one.model_copy(update={"chosen": True, "reason": why})
    return one.model_copy(update={"reason": Reason.of(ReasonCode.ANOTHER_CHOSEN, vehicle_id=best.vehicle_id)})


def _lasting(one: Candidate) -> str:
    return next((refusal.message for refusal in one.refusals if refusal.permanent), "see its refusals")


def _metres(one: Candidate) -> float:
    return math.inf if one.distance_m is None else one.distance_m


def _percent(one: Candidate) -> float:
    return -1.0 if one.battery_percent is None else one.battery_percent
