"""Changes of a run: /mission, /inserted-items, /continuation, and answers to consent requests."""

from __future__ import annotations

from typing import Annotated, Any, Final, Self

from aiohttp import web
from pydantic import ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from app.api.bodies import json_answer, json_body
from app.api.models import ConsentRequest, Identifier, RequestModel
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.services import REROUTING, RUNS
from app.domain.drop import consent
from app.domain.prediction import WindGiven
from app.domain.run.run import Run
from app.services.access import Role

# /runs/{run_id}/drops/{item_id}/consent: an operator's answer to a consent request.


async def answer_consent(call: Call[NoQuery, ConsentRequest]) -> web.Response:
    said = consent.Answer(grant=call.body.grant, question=call.body.question, comment=call.body.comment)
    run_id, item_id = call.path_value("run_id"), call.path_value("item_id")
    return json_answer(await call.request.app[RUNS].answer_consent(run_id, item_id, said, call.principal.name))


CONSENT_ROUTES: tuple[AnyRoute, ...] = tagged(
    "runs",
    Route(
        method="POST",
        path=f"{API}/runs/{{run_id}}/drops/{{item_id}}/consent",
        handler=answer_consent,
        summary="Grant or refuse consent to a drop; the first answer counts, and repeating it succeeds",
        role=Role.PILOT,
        body=json_body(ConsentRequest),
        answers=(Answer(200, "The run with the stored answer. The release follows after another check", Run),),
        errors=(
            *("resource.not_found", "drop.consent_not_asked", "drop.consent_too_late", "drop.consent_answered"),
            "storage.failed",
        ),
    ),
)


# /runs/{run_id}/mission, /inserted-items and /continuation.


class MissionChangeRequest(RequestModel):
    """Continue with `plan` (null: the run's current plan) at the item `continue_at` (null: the current item)."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    plan: Identifier | None = None
    continue_at: Identifier | None = None

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        if self.plan is None and self.continue_at is None:
            raise PydanticCustomError("nothing_changes", "specify plan, continue_at, or both")
        return self


class ContinuationRequest(RequestModel):
    """Fly the remaining items of a finished run, starting at `continue_at` (null: after the last completed item).

    `wind` is used by the check and the prediction; null means the wind of the finished run.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    continue_at: Identifier | None = None
    wind: WindGiven | None = None


class InsertedItemsRequest(RequestModel):
    """Insert `items` before or after the waypoint of an item that has not been reached."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    items: Annotated[list[Any], Field(min_length=1, max_length=100)]
    before: Identifier | None = None
    after: Identifier | None = None

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.before is None) == (self.after is None):
            raise PydanticCustomError("one_place", "specify exactly one of before and after")
        return self


async def change_mission(call: Call[NoQuery, MissionChangeRequest]) -> web.Response:
    run_id, asked = call.path_value("run_id"), call.body
    run = await call.request.app[REROUTING].change(run_id, asked.plan, asked.continue_at, call.principal.name)
    return accepted(run)


async def insert_items(call: Call[NoQuery, InsertedItemsRequest]) -> web.Response:
    run_id, asked = call.path_value("run_id"), call.body
    at, after = (asked.before, False) if asked.before is not None else (asked.after or "", True)
    rerouting = call.request.app[REROUTING]
    return accepted(await rerouting.insert(run_id, asked.items, at=at, after=after, actor=call.principal.name))


async def continue_run(call: Call[NoQuery, ContinuationRequest]) -> web.Response:
    run_id, asked = call.path_value("run_id"), call.body
    wind = None if asked.wind is None else asked.wind.wind()
    rerouting = call.request.app[REROUTING]
    return accepted(await rerouting.continue_over(run_id, asked.continue_at, wind, call.principal.name))


def accepted(run: Run) -> web.Response:
    """202 with the run and its Location."""
    return json_answer(run, status=202, headers={"Location": f"{API}/runs/{run.id}"})


ACCEPTED: Final = Answer(202, "The run. Poll Location or read the stream to follow it", Run, headers=("Location",))
_ERRORS: Final = (
    *(
        "resource.not_found",
        "state.conflict",
        "run.wrong_state",
        "run.drop_in_progress",
        "run.hold_required",
        "run.changing",
    ),
    *("plan.rejected", "vehicle.quarantined", "vehicle.refused", "vehicle.link", "vehicle.timeout"),
    *("mission.upload_failed", "storage.failed"),
)

CHANGE_ROUTES: tuple[AnyRoute, ...] = tagged(
    "runs",
    Route(
        method="POST",
        path=f"{API}/runs/{{run_id}}/mission",
        handler=change_mission,
        summary="Change the mission in flight, without a pause: another plan or another next item",
        role=Role.PILOT,
        body=json_body(MissionChangeRequest),
        answers=(ACCEPTED,),
        errors=_ERRORS,
        idempotent=True,
    ),
    Route(
        method="POST",
        path=f"{API}/runs/{{run_id}}/inserted-items",
        handler=insert_items,
        summary="Insert items into the mission of a run in progress",
        role=Role.PILOT,
        body=json_body(InsertedItemsRequest),
        answers=(ACCEPTED,),
        errors=("plan.invalid", *_ERRORS),
        idempotent=True,
    ),
    Route(
        method="POST",
        path=f"{API}/runs/{{run_id}}/continuation",
        handler=continue_run,
        summary="Create a run from the remaining items of a finished run; start it separately",
        role=Role.DISPATCHER,
        body=json_body(ContinuationRequest),
        answers=(ACCEPTED,),
        errors=(
            *(
                "resource.not_found",
                "state.conflict",
                "run.not_over",
                "run.no_remaining_items",
                "run.continued",
                "run.changing",
            ),
            *("plan.rejected", "vehicle.busy", "vehicle.taken", "vehicle.quarantined", "vehicle.refused"),
            *("vehicle.link", "vehicle.timeout", "storage.failed"),
        ),
        idempotent=True,
    ),
)
