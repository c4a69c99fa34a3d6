"""Records the inputs of a flight as JSON lines and reads them back, so that a flight can be replayed.

The first line of a part has the flight as it began, each other one an input and what was decided then. An observation
is written as what changed since the one before.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, get_type_hints

from pydantic import TypeAdapter

from app.domain.flight import inputs
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import FactReceived, FlightEffect, FlightFact, FlightInput, Observation, RecordEvent
from app.domain.flight.segment import segment_of
from app.domain.flight.step import step
from app.domain.mission import Mission
from app.domain.plan import Plan
from app.domain.run.run import Run
from app.domain.targets import TargetFix
from app.domain.vehicle.state import VehicleState

_OUR_CLOCK: Final = "clock"
"""Fields of the vehicle's state that the flight measures itself."""
_NEVER: Final = object()
_FACTS: Final = {fact.__name__: fact for fact in FlightFact.__args__}

Line = dict[str, Any]


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _dumped(kind: Any, value: object) -> Any:
    return _adapter(kind).dump_python(value, mode="json")


def _loaded(kind: Any, value: object) -> Any:
    """Convert from JSON for strict models: a list becomes a tuple, a string a member of an enumeration."""
    return _adapter(kind).validate_json(json.dumps(value))


@cache
def _fields(kind: type) -> dict[str, Any]:
    """Return the fields of a dataclass and their types."""
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind)}


def began(flight: Flight) -> Line:
    """The flight before its first input, except what derives from these."""
    return {
        "run": flight.run.model_dump(mode="json"),
        "plan": flight.segment.plan.model_dump(mode="json"),
        "mission": _dumped(Mission, flight.segment.mission),
        "approach_speeds_m_s": dict(flight.segment.approach_speeds_m_s),
        "now_s": flight.link.last_heard_s,
        "lost_after_s": flight.lost_after_s,
        "default_max_offset_m": flight.default_max_offset_m,
    }


def _flight(line: Line) -> Flight:
    run, plan, mission = _loaded(Run, line["run"]), _loaded(Plan, line["plan"]), _loaded(Mission, line["mission"])
    terms = (line["lost_after_s"], line["default_max_offset_m"])
    return Flight.of(run, segment_of(run, plan, mission, terms[1], line["approach_speeds_m_s"]), line["now_s"], *terms)


@dataclass(slots=True)
class Recorder:
    """Turns inputs into lines. It remembers the vehicle's state at the last one."""

    state: VehicleState | None = None

    def line(self, given: FlightInput, effects: tuple[FlightEffect, ...]) -> Line:
        """One input, and the effects of its step."""
        kind: type = type(given)
        line: Line = {"input": kind.__name__, "observed": self._observation(given.observed)}
        line["given"] = {
            name: _fact(given) if isinstance(given, FactReceived) else _dumped(of, getattr(given, name))
            for name, of in _fields(kind).items()
            if name != "observed"
        }
        if effects:
            line["effects"] = [effect_line(effect) for effect in effects]
        return line

    def _observation(self, observed: Observation) -> Line:
        before, self.state = self.state, observed.state
        state = {
            name: _dumped(kind, value)
            for name, kind in _fields(VehicleState).items()
            if name != _OUR_CLOCK
            if (value := getattr(observed.state, name)) != (_NEVER if before is None else getattr(before, name))
        }
        targets = {"targets": _dumped(dict[str, TargetFix], observed.targets)} if observed.targets else {}
        return {"now_s": observed.now_s, "time_s": observed.time_s, "state": state, **targets}


def _fact(given: FactReceived) -> Line:
    return {"name": type(given.fact).__name__, **_dumped(type(given.fact), given.fact)}


def effect_line(effect: FlightEffect) -> Line:
    """Return an effect in the form of a recorded line."""
    if isinstance(effect, RecordEvent):
        return {"event": effect.payload.kind.value, "data": effect.payload.model_dump(mode="json")}
    return {"command": type(effect).__name__, **_dumped(type(effect), effect)}


@dataclass(frozen=True, slots=True)
class Difference:
    """At an input (`at_s`: monotonic seconds since the start of the flight) the current code decides differently."""

    at_s: float
    input: str
    recorded: list[Line]
    today: list[Line]


@dataclass(frozen=True, slots=True)
class Replay:
    """The result: the number of inputs, the differences in decisions, and the resulting run."""

    inputs: int
    differences: tuple[Difference, ...]
    run: Run | None


def replay(lines: Iterable[Line], *, most: int = 20) -> Replay:
    """Replay a recorded flight with the current code, starting with its first part. Reports a limited number of
    differences.

    Each input is decided with the flight as today's code makes it of those before.
    """
    flight: Flight | None = None
    state: Line = {}
    differences: list[Difference] = []
    count, began_s = 0, 0.0
    for line in lines:
        if "input" not in line:
            flight, state = _flight(line), {}
            began_s = line["now_s"]
            continue
        if flight is None:
            raise ValueError("the first line does not describe the initial flight")
        count += 1
        state |= line["observed"]["state"]
        flight, effects = step(flight, _input(line, state))
        today = json.loads(json.dumps([effect_line(effect) for effect in effects]))
        recorded = line.get("effects", [])
        if json.dumps(today) != json.dumps(recorded) and len(differences) < most:
            differences.append(Difference(line["observed"]["now_s"] - began_s, line["input"], recorded, today))
    return Replay(count, tuple(differences), None if flight is None else flight.run)


def _input(line: Line, state: Line) -> FlightInput:
    kind = getattr(inputs, line["input"])
    seen = VehicleState(**{name: _loaded(_fields(VehicleState)[name], v) for name, v in state.items()})
    targets = _loaded(dict[str, TargetFix], line["observed"].get("targets", {}))
    observed = Observation(seen, line["observed"]["now_s"], line["observed"]["time_s"], targets)
    if kind is FactReceived:
        fact = dict(line["given"]["fact"])
        return FactReceived(observed, _loaded(_FACTS[fact.pop("name")], fact))
    given = {name: _loaded(of, line["given"][name]) for name, of in _fields(kind).items() if name != "observed"}
    read: FlightInput = kind(observed=observed, **given)
    return read


def as_text(lines: Iterable[Line]) -> str:
    """Encode as JSON lines; NaN is kept."""
    return "".join(json.dumps(line, separators=(",", ":")) + "\n" for line in lines)


def from_text(text: str) -> Iterator[Line]:
    """Decode the lines."""
    yield from (json.loads(line) for line in text.splitlines())
