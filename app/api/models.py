"""Request and response models that are not models of the services."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, AwareDatetime, BaseModel, Field, model_validator
from pydantic_core import PydanticCustomError

from app.domain.cluster.lease import LeaseState
from app.domain.events import Event
from app.domain.model import FrozenForm, StrictForm
from app.domain.prediction import WindGiven
from app.domain.validation.plain_text import PLAIN_TEXT
from app.services.plans import PlanHead
from app.services.views import VehicleView

Limit = Annotated[int, Field(ge=1, le=500, description="maximum number of results")]
After = Annotated[int, Field(ge=0, le=2**53, description="return only events with a higher seq")]
Identifier = Annotated[str, Field(min_length=1, max_length=100)]
Time = Annotated[AwareDatetime, Field(description="ISO 8601 with UTC offset, or Unix seconds")]


class ListQuery(FrozenForm):
    """Query parameters of a list."""

    limit: Limit = 50


class PlansQuery(ListQuery):
    """Query parameters of the list of plans. `older_than`: the page after this plan, taken from `next`."""

    older_than: Identifier | None = None


class EventsQuery(FrozenForm):
    """Query parameters of a page of events."""

    after: After = 0
    limit: Limit = 200


class RunRequest(StrictForm):
    """Fly a plan with a vehicle. With `start` false, upload and verify the mission and wait for the start command.

    `wind` is used by the check and the prediction of the run; null means calm air.
    """

    plan: Identifier
    vehicle: Identifier
    start: bool = False
    wind: WindGiven | None = None


class ConsentRequest(StrictForm):
    """Grant or refuse consent to a drop.

    `question` is the number of the consent request (`consent.question` of the drop). It is required for a grant, so
    that a grant never applies to a request that the operator has not seen. A refusal without it refuses the current
    request. `comment` appears in the delivery report.
    """

    grant: bool
    question: Annotated[int, Field(ge=1)] | None = None
    comment: Annotated[str, Field(max_length=500), PLAIN_TEXT] = ""

    @model_validator(mode="after")
    def _a_grant_names_its_question(self) -> Self:
        if self.grant and self.question is None:
            raise PydanticCustomError("question_required", "a grant requires the number of the consent request")
        return self


class PlanCheckRequest(StrictForm):
    """Check `plan` against the vehicle's type, or against the parameters and firmware of one vehicle, in this wind
    (null: calm air).
    """

    plan: Any
    vehicle: Identifier | None = None
    wind: WindGiven | None = None


class LinkKeyRequest(FrozenForm):
    """`trust_link` confirms that nobody else can read the vehicle's link: the key is sent unencrypted."""

    trust_link: Literal[True]


class VehiclesView(BaseModel):
    """All known vehicles, by ID."""

    vehicles: list[VehicleView]


class PlansView(BaseModel):
    """Plans without their documents, newest first. Pass `next` as `older_than` to get the next page; it is null on the
    last page.
    """

    plans: list[PlanHead]
    next: str | None = None


class EventsView(BaseModel):
    """A page of events in order; pass the `position` of the last one as `after` to get the next page.

    `first_seq` is the oldest event of the journal that is kept, `last_seq` its newest.
    """

    events: list[Event]
    first_seq: int
    last_seq: int


class HealthView(BaseModel):
    """The process is alive. `site_lease` is of a gateway of a cluster: `taken` if another gateway has its site."""

    status: str
    version: str
    site_lease: LeaseState | None = None


class ReadinessView(BaseModel):
    """`ready` without reasons, or the reasons by name."""

    ready: bool
    reasons: dict[str, str]


MAX_SHOWN_CHARS: Final = 40


def only_states_of(states: type[StrEnum]) -> AfterValidator:
    """Reject unknown states."""
    known = [state.value for state in states]

    def check(value: str) -> str:
        unknown = next((part for part in value.split(",") if part not in known), None)
        if unknown is not None:
            raise ValueError(f"unknown state {unknown[:MAX_SHOWN_CHARS]!r}; known states: {', '.join(known)}")
        return value

    return AfterValidator(check)
