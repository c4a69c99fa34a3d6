"""What most models have in common."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Frozen(BaseModel):
    """A record that never changes."""

    model_config = ConfigDict(frozen=True)


class FrozenForm(BaseModel):
    """The same, in which a field without a meaning is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class StrictForm(BaseModel):
    """The same, in which a value of another type is one too."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
