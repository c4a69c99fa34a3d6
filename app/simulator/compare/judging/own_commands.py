"""The vehicle's own COMMAND_LONGs: a mission's gripper item shows in nothing else but the servo output."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

from app.simulator.compare.heard import Dialogue, Heard
from app.simulator.compare.judging.alignment import Alignment, align, late
from app.simulator.compare.judging.verdict import Verdict
from app.simulator.compare.sides import Stand

ASPECT = "vehicle's own commands"
SOON_S = 0.26
"""The period that a command is held to: one is sent when something is over, or a quarter of a second later."""
REPEAT_S = 1.02
"""PX4 repeats a command after 0.5 or 1.0 s, whichever turn of its sender comes first."""
LAST_S = 4.0
"""A last repeat that comes later is not of this command."""
HEIGHT_M = 1.0
"""param7 is a height in all of these commands; PX4 measures it, the others are set."""


def judge_own_commands(recorded: Dialogue, simulated: Dialogue) -> Iterator[Verdict]:
    """Command, target and parameters in order; their times; the numbers and times of the repeats."""
    ours, theirs = _firsts(recorded), _firsts(simulated)
    if not ours and not theirs:
        return
    alignment = align(list(ours), list(theirs), short=0)
    yield Verdict(ASPECT, len(ours), alignment.differences + tuple(_heights(alignment, ours, theirs)))
    acts = (recorded.acts_s(), simulated.acts_s())
    yield Verdict(f"{ASPECT}: times", len(alignment.pairs), tuple(late(alignment, SOON_S, acts)))
    repeats = tuple(_repeats(recorded, simulated, alignment))
    yield Verdict(f"{ASPECT}: repeats", sum(_confirmations(recorded).values()), repeats)


def _commands(side: Dialogue) -> list[Heard]:
    return side.broadcast("COMMAND_LONG")


def _firsts(side: Dialogue) -> dict[Stand, float]:
    """The first transmission of each command, with its param7 (0 where that is never set)."""
    return {Stand(one.t_s, _said(one), 1): _height_m(one) for one in _commands(side) if not one.fields["confirmation"]}


def _is_at_boot(heard: Heard) -> bool:
    """The grab at power-up goes to 0/0, and PX4 leaves all but param2 uninitialised."""
    return not heard.fields["target_system"]


def _said(heard: Heard) -> str:
    fields = heard.fields
    numbers = (2,) if _is_at_boot(heard) else range(1, 7)
    params = " ".join("nan" if fields[f"param{n}"] is None else f"{fields[f'param{n}']:g}" for n in numbers)
    return f"command {fields['command']} [{params}] to {fields['target_system']}/{fields['target_component']}"


def _height_m(heard: Heard) -> float:
    height_m = heard.fields["param7"]
    return 0.0 if _is_at_boot(heard) else math.nan if height_m is None else float(height_m)


def _heights(alignment: Alignment, ours: dict[Stand, float], theirs: dict[Stand, float]) -> Iterator[str]:
    for a, b in alignment.pairs:
        if not abs(ours[a] - theirs[b]) <= HEIGHT_M and not math.isnan(ours[a]) & math.isnan(theirs[b]):
            yield f"{a.value}: param7 {ours[a]:.1f}, simulated {theirs[b]:.1f}"


def _confirmations(side: Dialogue) -> Counter[tuple[str, int]]:
    repeats = (one for one in _commands(side) if one.fields["confirmation"])
    return Counter((_said(one), one.fields["confirmation"]) for one in repeats)


def _repeats(recorded: Dialogue, simulated: Dialogue, alignment: Alignment) -> Iterator[str]:
    """How often each is repeated, and when the last repeat comes."""
    ours, theirs = _confirmations(recorded), _confirmations(simulated)
    for key in sorted(ours.keys() | theirs.keys()):
        if ours[key] != theirs[key]:
            yield f"{key[0]} confirmation {key[1]}: {ours[key]} times, simulated {theirs[key]}"
    last = max((confirmation for _, confirmation in ours), default=0)
    ours_s, theirs_s = _last_after_s(recorded, last), _last_after_s(simulated, last)
    for a, b in alignment.pairs:
        a_s, b_s = ours_s.get((a.value, a.t_s)), theirs_s.get((b.value, b.t_s))
        if (
            a_s is not None
            and (b_s is None or abs(a_s - b_s) > REPEAT_S)
            and ours[a.value, last] == theirs[a.value, last]
        ):
            after = "not" if b_s is None else f"{b_s:.2f} s"
            yield f"{a.value} confirmation {last} after {a_s:.2f} s, simulated {after}"


def _last_after_s(side: Dialogue, last: int) -> dict[tuple[str, float], float]:
    """From each first transmission to its last repeat, soon after; the boot's first is recorded without a clock."""
    found: dict[tuple[str, float], float] = {}
    ends = [(_said(one), one.t_s) for one in _commands(side) if one.fields["confirmation"] == last]
    for one in _commands(side):
        if one.fields["confirmation"] or _is_at_boot(one):
            continue
        said, t_s = _said(one), one.t_s
        end = next((end for end in ends if end[0] == said and 0.0 <= end[1] - t_s <= LAST_S), None)
        if end is not None:
            ends.remove(end)
            found[said, t_s] = end[1] - t_s
    return found
