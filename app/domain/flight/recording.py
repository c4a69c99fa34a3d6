"""Records the inputs of a flight as JSON lines and reads them back, so that a flight can be replayed.

The first line of a part has the initial flight, each other line an input and the resulting decisions. An observation is
encoded as the difference to the one before.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final, get_type_hints

from pydantic import TypeAdapter

from app.domain.flight import inputs
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import FlightEffect, FlightFact, FlightInput, Record, Sight, Told
from app.domain.flight.leg import leg_of
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
        "plan": flight.leg.plan.model_dump(mode="json"),
        "mission": _dumped(Mission, flight.leg.mission),
        "now_s": flight.connected_at_s,
        "lost_after_s": flight.lost_after_s,
        "default_max_offset_m": flight.default_max_offset_m,
    }


def _flight(line: Line) -> Flight:
    run, plan, mission = _loaded(Run, line["run"]), _loaded(Plan, line["plan"]), _loaded(Mission, line["mission"])
    terms = (line["lost_after_s"], line["default_max_offset_m"])
    return Flight.of(run, leg_of(run, plan, mission, terms[1]), line["now_s"], *terms)


def kind_of(heard: FlightInput) -> type:
    """The class of an input. The `input` of a line is its name."""
    return type(heard)


@dataclass(slots=True)
class Recorder:
    """Encodes inputs as lines. Remembers the last observation, and the run as the flight left it."""

    run: Run
    state: VehicleState | None = None

    def line(self, before: Run, heard: FlightInput, after: Flight, effects: tuple[FlightEffect, ...]) -> Line:
        """Encode an input. `before` is the run before the step, which others may have changed since the last one."""
        line: Line = {"input": type(heard).__name__, "sight": self._sight(heard.sight)}
        line["given"] = {
            name: _named(heard) if isinstance(heard, Told) else _dumped(kind, getattr(heard, name))
            for name, kind in _fields(kind_of(heard)).items()
            if name != "sight"
        }
        if before != self.run:
            line["run"] = _changes(self.run.model_dump(mode="json"), before.model_dump(mode="json"))
        if effects:
            line["effects"] = [told(effect) for effect in effects]
        self.run = after.run
        return line

    def _sight(self, sight: Sight) -> Line:
        before, self.state = self.state, sight.state
        state = {
            name: _dumped(kind, value)
            for name, kind in _fields(VehicleState).items()
            if name != _OUR_CLOCK
            if (value := getattr(sight.state, name)) != (_NEVER if before is None else getattr(before, name))
        }
        targets = {"targets": _dumped(dict[str, TargetFix], sight.targets)} if sight.targets else {}
        return {"now_s": sight.now_s, "time_s": sight.time_s, "state": state, **targets}


def _named(heard: Told) -> Line:
    return {"name": type(heard.fact).__name__, **_dumped(type(heard.fact), heard.fact)}


def _changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> Line:
    return {name: value for name, value in after.items() if name not in before or before[name] != value}


def told(effect: FlightEffect) -> Line:
    """Encode an effect."""
    if isinstance(effect, Record):
        return {"event": effect.payload.kind.value, "data": effect.payload.model_dump(mode="json")}
    return {"order": type(effect).__name__, **_dumped(type(effect), effect)}


@dataclass(frozen=True, slots=True)
class Difference:
    """At an input (`at_s`: monotonic seconds since the start of the flight) the current code decides differently."""

    at_s: float
    heard: str
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

    Each input is applied to the run as replayed so far, with the changes that others made at that time.
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
        state |= line["sight"]["state"]
        changed = {**flight.run.model_dump(mode="json"), **line.get("run", {})}
        flight = replace(flight, run=_loaded(Run, changed))
        flight, effects = step(flight, _heard(line, state))
        today = json.loads(json.dumps([told(effect) for effect in effects]))
        recorded = line.get("effects", [])
        if json.dumps(today) != json.dumps(recorded) and len(differences) < most:
            differences.append(Difference(line["sight"]["now_s"] - began_s, line["input"], recorded, today))
    return Replay(count, tuple(differences), None if flight is None else flight.run)


def _heard(line: Line, state: Line) -> FlightInput:
    kind = getattr(inputs, line["input"])
    seen = VehicleState(**{name: _loaded(_fields(VehicleState)[name], v) for name, v in state.items()})
    targets = _loaded(dict[str, TargetFix], line["sight"].get("targets", {}))
    sight = Sight(seen, line["sight"]["now_s"], line["sight"]["time_s"], targets)
    if kind is Told:
        fact = dict(line["given"]["fact"])
        return Told(sight, _loaded(_FACTS[fact.pop("name")], fact))
    given = {name: _loaded(of, line["given"][name]) for name, of in _fields(kind).items() if name != "sight"}
    heard: FlightInput = kind(sight=sight, **given)
    return heard


def as_text(lines: Iterable[Line]) -> str:
    """Encode as JSON lines; NaN is kept."""
    return "".join(json.dumps(line, separators=(",", ":")) + "\n" for line in lines)


def from_text(text: str) -> Iterator[Line]:
    """Decode the lines."""
    yield from (json.loads(line) for line in text.splitlines())
