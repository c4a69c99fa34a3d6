"""What a flight flies: a plan, its mission and its drops, from the take-off or since the plan was changed in flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.domain.consent import ConsentRecord
from app.domain.drop import DropOutcome, DropPhase, DropRecord
from app.domain.gripper_turns import GripperTurns
from app.domain.mission import CompiledDrop, Mission
from app.domain.plan import Gripper, Plan, Winch
from app.domain.run import IN_FLIGHT, PlanChange, Run, RunState
from app.services.runs.embedded_release import EmbeddedRelease
from app.services.runs.orders import Release
from app.services.runs.settings import RunSettings
from app.services.runs.supervised_release import SupervisedRelease

_NOT_STARTED = frozenset({RunState.CREATED, RunState.UPLOADING, RunState.UPLOADED})
_NEVER_AGAIN = frozenset({DropOutcome.RELEASED, DropOutcome.UNKNOWN})


@dataclass(frozen=True, slots=True)
class Leg:
    """One mission of a flight. `plan` is the whole plan; `mission` may be only the rest of it."""

    plan: Plan
    mission: Mission
    releases: tuple[Release, ...]

    @property
    def supervised(self) -> tuple[SupervisedRelease, ...]:
        """Its drops that Waydrop commands."""
        return tuple(release for release in self.releases if isinstance(release, SupervisedRelease))

    @property
    def feeds(self) -> tuple[str, ...]:
        """The feeds of the moving targets of its drops."""
        return tuple(release.feed for release in self.supervised if release.feed is not None)


def leg_of(run: Run, plan: Plan, mission: Mission, settings: RunSettings, *, changed_at: float | None = None) -> Leg:
    """The leg for a run that has a record of each of the mission's drops.

    `changed_at`: when the plan was changed in flight; no hold of this mission can have begun before.
    """
    offsets = {item.id: item.max_offset_m for item in plan.items if isinstance(item, Gripper | Winch)}
    targets = {item.id: item.target for item in plan.items if isinstance(item, Gripper)}
    made: list[Release] = []
    waited_at_s = run.updated_at if run.state in IN_FLIGHT else None
    taken_up = run.state not in _NOT_STARTED
    if changed_at is not None:
        waited_at_s, taken_up = changed_at, False
    on_failure = plan.contingency.on_drop_failure
    for drop in mission.drops:
        record = run.drop(drop.plan_item_id)
        if drop.supervised:
            offset_m = offsets.get(drop.plan_item_id) or settings.default_max_offset_m
            target = targets.get(drop.plan_item_id)
            made.append(SupervisedRelease(drop, record, offset_m, on_failure, waited_at_s, target))
        else:
            turns = GripperTurns.of(drop, mission)
            made.append(EmbeddedRelease(drop, record, on_failure, turns, taken_up=taken_up))
    return Leg(plan, mission, tuple(made))


def drop_records(mission: Mission) -> tuple[DropRecord, ...]:
    """The records of a mission's drops before the flight."""
    return tuple(_fresh(drop) for drop in mission.drops)


def carried_over(records: Sequence[DropRecord], mission: Mission) -> tuple[DropRecord, ...]:
    """The records after a change: those of the mission's drops are fresh, the others stay as they ended.

    A parcel that was kept may be tried again; how often consent was asked goes on counting, so that an old answer
    counts for nothing.
    """
    ahead = {drop.plan_item_id: drop for drop in mission.drops}
    found = [
        _fresh(ahead.pop(old.plan_item_id), old) if old.plan_item_id in ahead and not is_concluded(old) else old
        for old in records
    ]
    told = {old.plan_item_id for old in records}
    return (*found, *(_fresh(drop) for item_id, drop in ahead.items() if item_id not in told))


def changed_to(run: Run, change: PlanChange, mission: Mission) -> dict[str, object]:
    """The fields of a run whose vehicle carries the changed mission; `mission` is what is left of the plan."""
    return {
        "plan_id": change.plan_id,
        "plan_hash": change.plan_hash,
        "mission_hash": change.mission_hash,
        "mission_id": None if run.mission_id is None else change.mission_id,
        "change": change,
        "changing": None,
        "changes": run.changes + 1,
        "drops": carried_over(run.drops, mission),
        "reached_seq": None,
        "item_id": mission.plan_item_of.get(0),
    }


def is_concluded(record: DropRecord) -> bool:
    """Whether the drop must never be visited again: it is released, or nobody knows."""
    return record.phase is DropPhase.DONE and record.outcome in _NEVER_AGAIN


def _fresh(drop: CompiledDrop, old: DropRecord | None = None) -> DropRecord:
    questions = 0 if old is None or old.consent is None else old.consent.question
    return DropRecord(
        plan_item_id=drop.plan_item_id,
        supervised=drop.supervised,
        consent=ConsentRecord(question=questions) if drop.needs_consent else None,
        planned_latitude_deg=drop.latitude_deg,
        planned_longitude_deg=drop.longitude_deg,
    )
