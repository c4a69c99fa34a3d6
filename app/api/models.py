"""What requests and answers look like, where the services' own models are not enough."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any, Final, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from app.domain.events import Event
from app.domain.prediction import WindGiven
from app.services.plans import PlanHead
from app.services.views import VehicleView

Limit = Annotated[int, Field(ge=1, le=500, description="at most so many")]
After = Annotated[int, Field(ge=0, le=2**53, description="only events with a higher seq")]
Identifier = Annotated[str, Field(min_length=1, max_length=100)]


class RequestModel(BaseModel):
    """Unknown fields are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class ListQuery(RequestModel):
    """How many."""

    limit: Limit = 50


class EventsQuery(RequestModel):
    """Which events: a page of them, in order."""

    after: After = 0
    limit: Limit = 200


class RunRequest(RequestModel):
    """Fly this plan with this vehicle. `start` false: upload and verify only, and wait for the start.

    `wind` is what the check and the prediction of the run reckon with; null is calm air.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    plan: Identifier
    vehicle: Identifier
    start: bool = False
    wind: WindGiven | None = None


class ConsentRequest(RequestModel):
    """Consent to a drop that asks for it, or refuse it.

    `question` is the number of the question that is answered (the drop's `consent.question`). A grant needs it, so that
    it counts for nothing that the person has not seen; a refusal without it refuses whatever is asked now. `comment`
    goes into the delivery report.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    grant: bool
    question: Annotated[int, Field(ge=1)] | None = None
    comment: Annotated[str, Field(max_length=500)] = ""

    @model_validator(mode="after")
    def _a_grant_names_its_question(self) -> Self:
        if self.grant and self.question is None:
            raise PydanticCustomError("question_required", "a grant needs the number of the question that was seen")
        return self


class PlanCheckRequest(RequestModel):
    """Check `plan` (see the plan schema) against the vehicle's type, or against the facts of one vehicle, in this wind
    (null: in calm air).
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    plan: Any
    vehicle: Identifier | None = None
    wind: WindGiven | None = None


class VehiclesView(BaseModel):
    """All vehicles seen, by id."""

    vehicles: list[VehicleView]


class PlansView(BaseModel):
    """Plans without their documents, newest first."""

    plans: list[PlanHead]


class EventsView(BaseModel):
    """A page of events in order. `last_seq` is the newest there is; ask again after the last one of the page."""

    events: list[Event]
    last_seq: int


class HealthView(BaseModel):
    """The process answers."""

    status: str
    version: str


class ReadinessView(BaseModel):
    """`ready` with no reason, or the reasons by name."""

    ready: bool
    reasons: dict[str, str]


# States in a query, comma separated: `flying,at_drop`.


MAX_SHOWN_CHARS: Final = 40


def only_states_of(states: type[StrEnum]) -> AfterValidator:
    """Refuses a name that is no state of these."""
    known = [state.value for state in states]

    def check(value: str) -> str:
        unknown = next((part for part in value.split(",") if part not in known), None)
        if unknown is not None:
            raise ValueError(f"there is no state {unknown[:MAX_SHOWN_CHARS]!r}; known: {', '.join(known)}")
        return value

    return AfterValidator(check)
