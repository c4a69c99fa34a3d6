"""How a queued task is flown, mended before its turn: what is given takes the place of what was said."""

from __future__ import annotations

from typing import Any, Final, Self

from pydantic import ConfigDict, model_validator
from pydantic_core import PydanticCustomError

from app.domain.errors import TaskRefusedError
from app.domain.items.fields import SpeedMS
from app.domain.tasks.forms import UNLIMITED_S, AltitudeTerms, Circle, CircleRadiusM, DurationS, Task


def _no_defaults(schema: dict[str, Any]) -> None:
    """What is not given stays: the schema must promise no other value for it."""
    schema["minProperties"] = 1
    for field in schema["properties"].values():
        field.pop("default", None)


_ALTITUDES: Final = frozenset({"relative_altitude_m", "absolute_altitude_m"})


class TaskTerms(AltitudeTerms):
    """Only what is given changes. An altitude takes the place of the one there was.

    Null is an altitude: as high as the vehicle is when the task begins; and a speed: its own. `radius_m` is of a
    circle; null: as it is.
    """

    model_config = ConfigDict(json_schema_extra=_no_defaults)

    speed_m_s: SpeedMS | None = None
    duration_s: DurationS = UNLIMITED_S
    radius_m: CircleRadiusM | None = None

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        says_nothing = {"radius_m"} if self.radius_m is None else set()  # the only null that means "as it is"
        if not self.model_fields_set - says_nothing:
            raise PydanticCustomError("change_is_empty", "give at least one thing to change")
        return self

    @property
    def gives_altitude(self) -> bool:
        """Whether it says how high."""
        return bool(self.model_fields_set & _ALTITUDES)

    def applied(self, task: Task) -> Task:
        """The task on these terms; equal to it if they are the same. Raises TaskRefusedError: it has no radius."""
        given: dict[str, Any] = {name: getattr(self, name) for name in self.model_fields_set}
        if self.gives_altitude:
            given = {**dict.fromkeys(_ALTITUDES), **given}
        if given.pop("radius_m", None) is not None:
            if not isinstance(task, Circle):
                raise TaskRefusedError(
                    f"a {task.type} has no radius", refusal="tasks.no_radius", hint="leave radius_m out"
                )
            given["radius_m"] = self.radius_m
        return task.model_copy(update=given)
