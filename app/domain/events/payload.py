"""What all payloads have in common: their kind, and the version of their form."""

from __future__ import annotations

from typing import ClassVar, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, RootModel

from app.domain.events.kinds import EventKind

T = TypeVar("T")


class Payload(BaseModel):
    """What an event of one kind tells. A change of its form raises `version`, and adds how the older one is read."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: ClassVar[EventKind]
    version: ClassVar[int] = 1


class WholePayload(RootModel[T], Generic[T]):
    """A payload that is one whole record, `root`, and nothing beside it."""

    model_config = ConfigDict(frozen=True)

    kind: ClassVar[EventKind]
    version: ClassVar[int] = 1
