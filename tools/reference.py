"""What is generated from the domain: reference pages of rules, reasons and setpoints, the item types of the web page.

`python -m tests.support.regenerate_golden_missions` writes it.
"""

from __future__ import annotations

import json
from typing import Final

from app.domain.autopilot import autopilot
from app.domain.autopilot.capability import Cell, FlightKind
from app.domain.items import ITEM_TYPES, Drop, Stop, type_of
from app.domain.offboard.messages import WIRE_FORMS, WireForm
from app.domain.reasons import ReasonCode
from app.domain.rules.check import RULES
from app.domain.rules.registry import Rule

_RULES_HEAD = """# Rules

<!-- Generated from app/domain/rules by `python -m tests.support.regenerate_golden_missions`. Do not edit. -->

Waydrop checks every plan against these rules before it sends anything, and returns all findings at once. Each finding
has a code, a JSON Pointer into the plan, a message and a hint. An **error** rejects the plan. A **warning** is
displayed and stored with the run. Codes are stable. Codes that start with `plan.` concern the document itself: see
[plan format](plan-format.md). "Flown" in the last column means verified in flight on PX4 main (v1.18) in simulation.
"Waydrop" means that the autopilot has no such check.

## Unknown facts

Many rules need facts of the vehicle: parameters, firmware, home, storage. If a finding depends on facts that are
unknown, `assumed` lists them.

- **Without a vehicle** (`POST /plans`, or `waydrop validate` without `--vehicle`), PX4's defaults are assumed. A
  finding that depends on them is a warning, and its message starts with "depends on the vehicle:". The plan is rejected
  only if no vehicle could fly it. A run, job or check with a vehicle uses the facts of that vehicle. `home` of the plan
  counts as known.
- **With a vehicle that does not report a fact**, PX4's default is assumed (the rule states it where firmware versions
  differ). The finding stays an error, because a plan that is accepted for a vehicle must be accepted by it. The message
  lists the assumptions. A missing parameter alone never rejects a plan, because old firmware lacks some.
- **Without a home position**, the heights of absolute altitudes are not checked, and the warning
  `vehicle.altitudes_not_comparable` says so. A vehicle without a home is rejected (`vehicle.home_unknown`).

## All rules

| code | severity | why | source |
|---|---|---|---|
"""


def rules_page() -> str:
    """Return Markdown with one line per rule, in the order of the checks."""
    return _RULES_HEAD + "".join(_line(rule) for rule in RULES)


def _line(rule: Rule) -> str:
    cells = (f"`{rule.code}`", str(rule.severity), rule.reason, rule.source)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"


_REASONS_HEAD = """# Reasons

<!-- Generated from app/domain/reasons.py; `python -m tests.support.regenerate_golden_missions` writes it anew. -->

The reason of a state of a run, drop, job or queue is a code with parameters. It may have an underlying reason, its
`cause`:

```json
{"code": "drop.item_may_have_passed", "params": {},
 "cause": {"code": "run.not_heard", "params": {"silent_s": 60.2}, "cause": null}}
```

`null` means that there is no reason. Codes are stable, so programs should depend on them. Messages are for people and
may change: `{name}` is the parameter of that name, `{cause}` the message of the underlying reason. In an `error`, the
parameter `error` is a problem code of the API and `detail` its message. A release may add codes: display unknown codes
as they are.

| code | message |
|---|---|
"""


def reasons_page() -> str:
    """Return Markdown with one line per code."""
    return _REASONS_HEAD + "".join(f"| `{code.value}` | {code.words} |\n" for code in ReasonCode)


def reason_words() -> str:
    """Return JSON with the message of each code."""
    return json.dumps({code.value: code.words for code in ReasonCode}, indent=2) + "\n"


BEGIN: Final = "<!-- generated from app/domain/setpoint: `python -m tests.support.regenerate_golden_missions` -->"
END: Final = "<!-- end of what is generated -->"
_KINDS: Final = (FlightKind.ROTARY, FlightKind.WING, FlightKind.ROVER)
_SHORT: Final = {
    "SET_POSITION_TARGET_LOCAL_NED": "LOCAL_NED",
    "SET_POSITION_TARGET_GLOBAL_INT": "GLOBAL_INT",
    "SET_ATTITUDE_TARGET": "ATTITUDE",
    "none": "none",
}


def with_tables(page: str) -> str:
    """The page with what lies between the two marks made anew."""
    head, _, rest = page.partition(BEGIN)
    _, _, tail = rest.partition(END)
    return f"{head}{BEGIN}\n\n{setpoint_tables()}\n{END}{tail}"


def setpoint_tables() -> str:
    """Markdown: each form on the wire and for each kind of vehicle, then every reason."""
    lines = [
        "| form | message, frame, type mask | needs | hovering | wing | rover |",
        "|---|---|---|---|---|---|",
    ]
    for form, wire in WIRE_FORMS.items():
        cells = (_cell(autopilot().setpoints[kind][form]) for kind in _KINDS)
        lines.append(f"| `{form}` | {_on_the_wire(wire)} | {wire.estimate.value} | " + " | ".join(cells) + " |")
    lines += ["", "| code | why it is refused |", "|---|---|"]
    lines += [f"| `{code}` | {reason} |" for code, reason in _refusals()]
    return "\n".join(lines) + "\n"


def _cell(cell: Cell) -> str:
    documented, flown = cell
    if documented.is_accepted and flown.is_accepted:
        return "yes"
    if not documented.is_accepted and not flown.is_accepted:
        return "no: " + _code(flown.code)
    words = "by the documents" if documented.is_accepted else "as flown"
    return f"{words}, else {_code(flown.code if documented.is_accepted else documented.code)}"


def _code(code: str) -> str:
    return "`" + code.removeprefix("setpoint.") + "`"


def _on_the_wire(wire: WireForm) -> str:
    if wire.message == "none":
        return "none"
    frame = "" if wire.frame is None else f", {wire.frame.name}"
    return f"{_SHORT[wire.message]}{frame}, {wire.type_mask}"


def _refusals() -> list[tuple[str, str]]:
    found: dict[tuple[str, str], None] = {}
    for kind in FlightKind:
        for cell in autopilot().setpoints[kind].values():
            for support in cell:
                if not support.is_accepted:
                    found[support.code.removeprefix("setpoint."), support.reason] = None
    return sorted(found)


def item_types() -> str:
    """Return JSON: for each type its `type`, `title`, `stem`, initial fields (`fresh`) and properties."""
    types = [
        {
            "type": type_of(kind),
            "title": kind.title,
            "stem": kind.stem or type_of(kind),
            "fresh": dict(kind.fresh),
            "has_place": issubclass(kind, Stop),
            "ends": kind.lands,
            "is_drop": issubclass(kind, Drop),
            "at_stop": kind.needs_stop,
            "near_ground": kind.takes_off or kind.lands,
            "can_skip_to": not kind.takes_off and (kind.moves or kind.is_drop or kind.waits or kind.needs_stop),
        }
        for kind in ITEM_TYPES
    ]
    return json.dumps(types, indent=2) + "\n"
