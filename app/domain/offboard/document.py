"""The tables of docs/reference/offboard.md, made from the capability table itself."""

from __future__ import annotations

from typing import Final

from app.domain.autopilot import autopilot
from app.domain.autopilot.capability import Cell, FlightKind
from app.domain.offboard.messages import WIRE_FORMS, WireForm

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
    lines += [f"| `{code}` | {reason} |" for code, reason in _reasons()]
    return "\n".join(lines) + "\n"


def _cell(cell: Cell) -> str:
    documented, flown = cell
    if documented.is_taken and flown.is_taken:
        return "yes"
    if not documented.is_taken and not flown.is_taken:
        return "no: " + _code(flown.code)
    words = "by the documents" if documented.is_taken else "as flown"
    return f"{words}, else {_code(flown.code if documented.is_taken else documented.code)}"


def _code(code: str) -> str:
    return "`" + code.removeprefix("setpoint.") + "`"


def _on_the_wire(wire: WireForm) -> str:
    if wire.message == "none":
        return "none"
    frame = "" if wire.frame is None else f", {wire.frame.name}"
    return f"{_SHORT[wire.message]}{frame}, {wire.type_mask}"


def _reasons() -> list[tuple[str, str]]:
    found: dict[tuple[str, str], None] = {}
    for kind in FlightKind:
        for cell in autopilot().setpoints[kind].values():
            for verdict in cell:
                if not verdict.is_taken:
                    found[verdict.code.removeprefix("setpoint."), verdict.reason] = None
    return sorted(found)
