"""Changes of a run: /mission, /inserted-items, /continuation, and answers to consent requests."""

from __future__ import annotations

from typing import Annotated, Any, Final, Self

from aiohttp import web
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from app.api.bodies import json_answer
from app.api.models import ConsentRequest, Identifier
from app.api.routing import API, NEW_WORK, STORED, VEHICLE, Answer, Call, NoQuery, Routes
from app.domain.drop import consent
from app.domain.model import StrictForm
from app.domain.prediction import WindGiven
from app.domain.run.run import Run
from app.services.access import Role

ROUTES: Final = Routes("runs")


@ROUTES.route(
    "POST",
    "/runs/{run_id}/drops/{item_id}/consent",
    Role.PILOT,
    Answer(200, "The run with the stored answer. The release follows after another check", Run),
    errors=(*STORED, "drop.consent_not_asked", "drop.consent_too_late", "drop.consent_answered"),
    is_urgent=True,
)
async def answer_consent(call: Call[NoQuery, ConsentRequest]) -> web.Response:
    """Grant or refuse consent to a drop; the first answer counts, and repeating it succeeds."""
    said = consent.Answer(grant=call.body.grant, question=call.body.question, comment=call.body.comment)
    run_id, item_id = call.path_value("run_id"), call.path_value("item_id")
    return json_answer(await call.services.runs.answer_consent(run_id, item_id, said, call.principal.name))


class MissionChangeRequest(StrictForm):
    """Continue with `plan` (null: the run's current plan) at the item `continue_at` (null: the current item)."""

    plan: Identifier | None = None
    continue_at: Identifier | None = None

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        if self.plan is None and self.continue_at is None:
            raise PydanticCustomError("nothing_changes", "specify plan, continue_at, or both")
        return self


class ContinuationRequest(StrictForm):
    """Fly the remaining items of a finished run, starting at `continue_at` (null: after the last completed item).

    `wind` is used by the check and the prediction; null means the wind of the finished run.
    """

    continue_at: Identifier | None = None
    wind: WindGiven | None = None


class InsertedItemsRequest(StrictForm):
    """Insert `items` before or after the waypoint of an item that has not been reached."""

    items: Annotated[list[Any], Field(min_length=1, max_length=100)]
    before: Identifier | None = None
    after: Identifier | None = None

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.before is None) == (self.after is None):
            raise PydanticCustomError("one_place", "specify exactly one of before and after")
        return self


def accepted(run: Run) -> web.Response:
    """202 with the run and its Location."""
    return json_answer(run, status=202, headers={"Location": f"{API}/runs/{run.id}"})


ACCEPTED: Final = Answer(202, "The run. Poll Location or read the stream to follow it", Run, headers=("Location",))
_ERRORS: Final = (
    *STORED,
    *VEHICLE,
    *NEW_WORK,
    "state.conflict",
    "run.wrong_state",
    "run.not_followed",
    "run.drop_in_progress",
    "run.hold_required",
    "run.changing",
    "plan.rejected",
    "plan.work_timeout",
    "mission.upload_failed",
)


@ROUTES.route("POST", "/runs/{run_id}/mission", Role.PILOT, ACCEPTED, errors=_ERRORS)
async def change_mission(call: Call[NoQuery, MissionChangeRequest]) -> web.Response:
    """Change the mission in flight, without a pause: another plan or another next item."""
    run_id, asked = call.path_value("run_id"), call.body
    rerouting, actor, answer = call.services.rerouting, call.principal.name, call.answered(accepted)
    return accepted(await rerouting.change(run_id, asked.plan, asked.continue_at, actor, answer))


@ROUTES.route("POST", "/runs/{run_id}/inserted-items", Role.PILOT, ACCEPTED, errors=("plan.invalid", *_ERRORS))
async def insert_items(call: Call[NoQuery, InsertedItemsRequest]) -> web.Response:
    """Insert items into the mission of a run in progress."""
    run_id, asked = call.path_value("run_id"), call.body
    at, after = (asked.before, False) if asked.before is not None else (asked.after or "", True)
    rerouting, actor, answer = call.services.rerouting, call.principal.name, call.answered(accepted)
    return accepted(await rerouting.insert(run_id, asked.items, at=at, after=after, actor=actor, answer=answer))


@ROUTES.route(
    "POST",
    "/runs/{run_id}/continuation",
    Role.DISPATCHER,
    ACCEPTED,
    errors=(
        *STORED,
        *VEHICLE,
        *NEW_WORK,
        "state.conflict",
        "run.not_over",
        "run.no_remaining_items",
        "run.continued",
        "run.changing",
        "plan.rejected",
        "plan.work_timeout",
        "vehicle.busy",
        "vehicle.taken",
    ),
)
async def continue_run(call: Call[NoQuery, ContinuationRequest]) -> web.Response:
    """Create a run from the remaining items of a finished run; start it separately."""
    run_id, asked = call.path_value("run_id"), call.body
    wind = None if asked.wind is None else asked.wind.wind()
    rerouting, actor, answer = call.services.rerouting, call.principal.name, call.answered(accepted)
    return accepted(await rerouting.continue_over(run_id, asked.continue_at, wind, actor, answer))
