"""The tasks: navigation patterns of Paparazzi's mission controller, in human units. `null` is "not given", never 0."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from app.domain.errors import TaskRefusedError
from app.domain.items.fields import (
    AbsoluteAltitudeM,
    LatitudeDeg,
    LongitudeDeg,
    RelativeAltitudeM,
    SignedRadiusM,
    SpeedMS,
    YawDeg,
)
from app.domain.offboard.setpoints import Metres, MetresPerSecond, SetpointModel

MAX_PATH_POINTS: Final = 5
UNLIMITED_S: Final = -1.0
DurationS = Annotated[
    float,
    Field(ge=-1e6, le=86_400, allow_inf_nan=False, description="the task ends after so long; 0 or less: no limit"),
]


def _is_a_circle(radius_m: float) -> float:
    if abs(radius_m) < 1.0:
        raise PydanticCustomError("radius_too_small", "the radius is at least 1 m, or at most -1 m")
    return radius_m


CircleRadiusM = Annotated[SignedRadiusM, AfterValidator(_is_a_circle)]
GripperAction = Literal["release", "grab"]
InsertMode = Literal["append", "prepend", "replace_current", "replace_all"]
WhenEmpty = Literal["plan", "wait"]


class LocalPoint(SetpointModel):
    """Metres east and north of the EKF origin, which every answer names. Home is another place, and moves."""

    east_m: Metres
    north_m: Metres


class GlobalPoint(SetpointModel):
    """A place on the map."""

    latitude_deg: LatitudeDeg
    longitude_deg: LongitudeDeg


TaskPoint = LocalPoint | GlobalPoint


class Motion(SetpointModel):
    """The motion of a target over ground, such as a ship."""

    north_m_s: MetresPerSecond
    east_m_s: MetresPerSecond


class AltitudeTerms(SetpointModel):
    """How high: above home, or AMSL."""

    relative_altitude_m: RelativeAltitudeM | None = None
    absolute_altitude_m: AbsoluteAltitudeM | None = None

    @model_validator(mode="after")
    def _at_most_one_altitude(self) -> Self:
        if self.relative_altitude_m is not None and self.absolute_altitude_m is not None:
            raise PydanticCustomError(
                "altitude_at_most_one", "give at most one of relative_altitude_m and absolute_altitude_m"
            )
        return self


class TaskModel(AltitudeTerms):
    """What all tasks share. With neither altitude the task is flown at the one at which it begins."""

    speed_m_s: SpeedMS | None = None
    duration_s: DurationS = UNLIMITED_S


class Goto(TaskModel):
    """Go to a point; ends there. `stay`: wait there until the duration ends, or indefinitely.

    `gripper`: operate the gripper at the point; ends with the vehicle's final acknowledgement. `motion`: the point
    moves; it is followed until the duration ends, and updated by `target`.
    """

    type: Literal["goto"]
    point: TaskPoint
    stay: bool = False
    yaw_deg: YawDeg | None = None
    gripper: GripperAction | None = None
    motion: Motion | None = None

    @model_validator(mode="after")
    def _no_drop_on_the_move(self) -> Self:
        if self.gripper is not None and (self.motion is not None or self.stay):
            raise PydanticCustomError("gripper_alone", "gripper goes with neither stay nor motion")
        return self


class Circle(TaskModel):
    """Fly round a place: a positive radius clockwise, a negative one counter-clockwise. Ends by its duration only."""

    type: Literal["circle"]
    center: TaskPoint
    radius_m: CircleRadiusM


class Segment(TaskModel):
    """Fly along the line between two places; ends at its end."""

    type: Literal["segment"]
    start: TaskPoint
    end: TaskPoint


class Path(TaskModel):
    """Fly along the lines between one and five places; ends at the last."""

    type: Literal["path"]
    points: Annotated[tuple[TaskPoint, ...], Field(strict=False, min_length=1, max_length=MAX_PATH_POINTS)]


Task = Annotated[Goto | Circle | Segment | Path, Field(discriminator="type")]


TASK_NUMBERS: Final[dict[str, int]] = {"goto": 1, "circle": 2, "segment": 3, "path": 4}
"""The types in the status report, as in Paparazzi's MISSION_STATUS; an empty queue is [0]."""
EMPTY_LIST: Final = (0,)


def _no_defaults(schema: dict[str, Any]) -> None:
    """Omitted fields do not change, so the schema must not have defaults."""
    schema["minProperties"] = 1
    for field in schema["properties"].values():
        field.pop("default", None)


_ALTITUDES: Final = frozenset({"relative_altitude_m", "absolute_altitude_m"})


class TaskTerms(AltitudeTerms):
    """Only given fields change. An altitude replaces the previous one.

    A null altitude is the vehicle's altitude at the start of the task, a null speed the default one. `radius_m` is only
    for a circle; null: unchanged.
    """

    model_config = ConfigDict(json_schema_extra=_no_defaults)

    speed_m_s: SpeedMS | None = None
    duration_s: DurationS = UNLIMITED_S
    radius_m: CircleRadiusM | None = None

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        says_nothing = {"radius_m"} if self.radius_m is None else set()  # the only null that means "unchanged"
        if not self.model_fields_set - says_nothing:
            raise PydanticCustomError("change_is_empty", "give at least one thing to change")
        return self

    @property
    def gives_altitude(self) -> bool:
        return bool(self.model_fields_set & _ALTITUDES)

    def applied(self, task: Task) -> Task:
        """The task on these terms; equal to it if they are the same. Raises TaskRefusedError: it has no radius."""
        given: dict[str, Any] = {name: getattr(self, name) for name in self.model_fields_set}
        if self.gives_altitude:
            given = {**dict.fromkeys(_ALTITUDES), **given}
        if given.pop("radius_m", None) is not None:
            if not isinstance(task, Circle):
                raise TaskRefusedError(
                    f"a {task.type} has no radius", refusal="task.no_radius", hint="leave radius_m out"
                )
            given["radius_m"] = self.radius_m
        return task.model_copy(update=given)
