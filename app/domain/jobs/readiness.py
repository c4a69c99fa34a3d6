"""What speaks against a vehicle now, whatever the plan: a job is never begun, nor a start asked, over any of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from app.domain.autopilot import autopilot
from app.domain.jobs.candidate import Refusal, VehicleRefusal
from app.domain.jobs.job import Wish
from app.domain.reason import Reason
from app.domain.vehicle import LandedState, VehicleState


@dataclass(frozen=True, slots=True)
class VehicleSight:
    """One vehicle as the queue sees it. `held_by`: the run or job that has it. `stopped`: why its queue stands."""

    vehicle_id: str
    state: VehicleState
    quarantined: Reason | None = None
    held_by: str | None = None
    lease_holder: str | None = None
    stopped: Reason | None = None


def why_not_ready(sight: VehicleSight) -> tuple[Refusal, ...]:
    """Every reason; none: landed, disarmed, connected, free. What is not known counts as a reason."""
    return tuple(_reasons(sight))


def why_not_wished(vehicle_id: str, battery_percent: float | None, wish: Wish) -> tuple[Refusal, ...]:
    """What the job itself asks of the vehicle, and it has not."""
    return tuple(_unwished(vehicle_id, battery_percent, wish))


def _reasons(sight: VehicleSight) -> Iterator[Refusal]:
    state = sight.state
    if sight.quarantined is not None:
        hint = f"give each vehicle its own {autopilot().system_id_name}, then restart Waydrop"
        yield _refusal(VehicleRefusal.QUARANTINED, "it is quarantined: two vehicles have its system id", hint)
    if not state.connected:
        yield _refusal(VehicleRefusal.DISCONNECTED, "its link is lost")
    if sight.held_by is not None:
        yield _refusal(VehicleRefusal.BUSY, f"it has {sight.held_by}", "wait until that is over")
    if sight.lease_holder is not None:
        yield _refusal(VehicleRefusal.LEASED, f"{sight.lease_holder} has its offboard lease")
    if state.armed is not False:
        yield _refusal(VehicleRefusal.ARMED, "it is armed" if state.armed else "it does not tell whether it is armed")
    if state.landed is not LandedState.ON_GROUND:
        yield _refusal(VehicleRefusal.NOT_LANDED, f"it is not known to be on the ground (landed: {state.landed.value})")
    if state.in_failsafe:
        yield _refusal(VehicleRefusal.IN_FAILSAFE, "it acts on a failsafe")
    if sight.stopped is not None:
        hint = f"look at the vehicle, then POST /api/v1/job-queues/{sight.vehicle_id}/resume"
        refusal = _refusal(VehicleRefusal.QUEUE_STOPPED, "its queue is stopped", hint)
        yield refusal.model_copy(update={"reason": sight.stopped})


def _unwished(vehicle_id: str, battery_percent: float | None, wish: Wish) -> Iterator[Refusal]:
    if not wish.allows(vehicle_id):
        refusal = _refusal(VehicleRefusal.NOT_ALLOWED, f"the job names {', '.join(wish.named)}")
        yield refusal.model_copy(update={"lasting": True})
    least = wish.min_battery_percent
    if least > 0 and battery_percent is None:
        hint = "min_battery_percent 0 takes a vehicle that does not tell"
        yield _refusal(VehicleRefusal.BATTERY_UNKNOWN, "it does not tell its battery", hint)
    elif battery_percent is not None and battery_percent < least:
        message = f"its battery has {battery_percent:.0f} %, the job asks for {least:g} %"
        yield _refusal(VehicleRefusal.BATTERY_LOW, message, "charge it, or ask for less")


def _refusal(code: VehicleRefusal, message: str, hint: str = "") -> Refusal:
    return Refusal(code=code.value, message=message, hint=hint)
