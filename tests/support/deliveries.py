"""Deliveries for webhooks to tell: runs written to the journal as a flight writes them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from app.domain.drop.record import Certainty, DropOutcome, DropPhase, DropRecord
from app.domain.events import AnyPayload, NewEvent
from app.domain.events.run import RunChanged, RunCreated, RunDrop, RunItem
from app.domain.run.run import Run, RunState
from app.services.journal import Journal
from tests.support.service_in_process import Service
from tests.support.webhook_receiver import Receiver

DELIVERED = ["delivery.created", "delivery.departed", "drop.released", "delivery.completed"]


def flown(plan_id: str, run_id: str) -> Iterator[tuple[NewEvent, Run]]:
    """A whole delivery in a few events, one of them nobody's news, each with the run after it."""
    drop = DropRecord(plan_item_id="drop", supervised=True)
    run = Run(
        id=run_id, plan_id=plan_id, plan_hash="ab", vehicle_id="v1", drops=(drop,), created_at=1.0, updated_at=1.0
    )
    yield _event(run, RunCreated(run)), run
    flying = run.model_copy(update={"state": RunState.FLYING})
    yield _event(flying, RunChanged(flying)), flying
    yield _event(flying, RunItem(item_id="drop", seq=1, phase="current")), flying
    ended = {"phase": DropPhase.DONE, "outcome": DropOutcome.RELEASED, "certainty": Certainty.ACKNOWLEDGED}
    done = drop.model_copy(update=ended)
    dropped = flying.with_drop(done, now=2.0)
    yield _event(dropped, RunDrop(done)), dropped
    over = dropped.model_copy(update={"state": RunState.COMPLETED, "updated_at": 3.0})
    yield _event(over, RunChanged(over)), over


async def deliver(journal: Journal, plan_id: str, run_id: str) -> None:
    """Record a whole delivery."""
    for event, run in flown(plan_id, run_id):
        await journal.record(event, runs=(run,))


async def a_plan(service: Service, plan: dict[str, Any]) -> str:
    """A stored plan."""
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    return str(made["id"])


async def hook(service: Service, receiver: Receiver, **more: Any) -> tuple[str, str]:
    """A webhook to the receiver; its id and its secret."""
    status, _, made = await service.call("POST", "/api/v1/webhooks", json={"url": receiver.url, **more})
    assert status == 201, made
    return made["webhook"]["id"], made["secret"]


def _event(run: Run, payload: AnyPayload) -> NewEvent:
    return NewEvent.of(payload, 1000.0, vehicle_id="v1", run_id=run.id)
