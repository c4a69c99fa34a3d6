"""What the vehicle answers and says: protocol replies, its own commands, status texts and events."""

from __future__ import annotations

import bisect
import math
import re
from collections import Counter
from collections.abc import Iterator
from typing import Any

from app.simulator.events import EVENTS
from tools.compare.alignment import Alignment, Verdict, align, joined, late, times_agree
from tools.compare.trace import Dialogue, Fields, ReceivedMessage, Sent, Stand, stands

# Answers to the ground side: mission protocol, command acks, parameters; what, to whom, how soon.


REPLY_S, REPEAT_S = 0.1, 0.26
"""The periods that replies are held to: some cycles of the vehicle's loops, and that of repeated mission requests."""
PARAMS = ("param1", "param2", "param3", "param4")
ITEM = ("seq", "frame", "command", "current", "autocontinue", *PARAMS, "x", "y", "z", "mission_type")
KEYS: dict[str, tuple[str, ...]] = {
    "MISSION_REQUEST_INT": ("seq", "mission_type"),
    "MISSION_REQUEST": ("seq", "mission_type"),
    "MISSION_ACK": ("type", "mission_type", "opaque_id"),
    "MISSION_COUNT": ("count", "mission_type", "opaque_id"),
    "MISSION_ITEM_INT": ITEM,
    "MISSION_ITEM": ITEM,
    "COMMAND_ACK": ("command", "result", "progress"),
    "PARAM_VALUE": ("param_id", "param_type", "param_value"),
    "PARAM_ERROR": ("param_id", "error"),
}
PARAM_LIST = "PARAM_REQUEST_LIST"
MISSION = tuple(name for name in KEYS if name.startswith("MISSION"))
COMMAND = ("COMMAND_ACK",)
PARAM = ("PARAM_VALUE", "PARAM_ERROR")
PROTOCOLS = (
    ("mission protocol", MISSION, REPEAT_S),
    ("command acks", COMMAND, REPLY_S),
    ("parameters", PARAM, REPLY_S),
)


def judge_replies(recorded: Dialogue, simulated: Dialogue) -> Iterator[Verdict]:
    """The three protocols, each with its times; and the parameter list."""
    for aspect, names, period_s in PROTOCOLS:
        links = {received.link for side in (recorded, simulated) for received in side.named(*names)}
        by_link = [
            (_replies(recorded, names, link), _replies(simulated, names, link)) for link in sorted(links, key=str)
        ]
        if not any(ours or theirs for ours, theirs in by_link):
            continue
        alignment = joined(align(ours, theirs, short=0) for ours, theirs in by_link)
        yield Verdict(aspect, sum(len(ours) for ours, _ in by_link), alignment.differences)
        delays = ((_delay_s(recorded, a), _delay_s(simulated, b), a) for a, b in alignment.pairs)
        late = tuple(
            f"{stand.value}: {a_s:.2f} s, simulated {b_s:.2f} s"
            for a_s, b_s, stand in delays
            if a_s is not None and b_s is not None and not times_agree(a_s, b_s, period_s)
        )
        repeats = tuple(
            f"{a.value}: {a.count} times, simulated {b.count}"
            for a, b in alignment.pairs
            if abs(a.count - b.count) > max(1.0, 0.2 * a.count)
        )
        yield Verdict(f"{aspect}: times", len(alignment.pairs), late + repeats)
    if any(sent.name == PARAM_LIST for sent in recorded.sent):
        ours_all, theirs_all = _listed(recorded), _listed(simulated)
        yield Verdict("parameter list", len(ours_all.keys() & theirs_all.keys()), tuple(_unlike(ours_all, theirs_all)))


def _replies(side: Dialogue, names: tuple[str, ...], link: str | None) -> list[Stand]:
    """Of one link: each is a task of its own in PX4, and which of two is the first is chance."""
    grounds = {sent.source[0] for sent in side.sent}
    asked: dict[str, float] = {}
    for sent in side.sent:
        if sent.name.startswith("PARAM") and sent.name != PARAM_LIST:
            asked.setdefault(sent.fields["param_id"], sent.t_s)

    def value(received: ReceivedMessage) -> str | None:
        fields = received.fields
        if "param_id" in fields:
            return _shown(received) if asked.get(fields["param_id"], math.inf) <= received.t_s else None
        return _shown(received) if fields["target_system"] in grounds else None

    return stands((received for received in side.named(*names) if received.link == link), value)


def _listed(side: Dialogue) -> dict[str, str]:
    """The parameters that were told after the first request of a list, each as it was told first."""
    asked_s = min((sent.t_s for sent in side.sent if sent.name == PARAM_LIST), default=math.inf)
    told = [one.fields for one in side.named("PARAM_VALUE") if one.t_s >= asked_s]
    return {one["param_id"]: f"{_number(one['param_value'])} of type {one['param_type']}" for one in reversed(told)}


def _unlike(ours: dict[str, str], theirs: dict[str, str]) -> Iterator[str]:
    """A simulated vehicle has the parameters that it uses, PX4 some hundreds more: those are not missing."""
    if ours and not theirs:
        yield f"{PARAM_LIST} is not answered"
    for name in sorted(theirs):
        if name not in ours:
            yield f"extra: {name}"
        elif ours[name] != theirs[name]:
            yield f"{name}: {ours[name]}, simulated {theirs[name]}"


def _shown(received: ReceivedMessage) -> str:
    fields = received.fields
    address = f" to {fields['target_system']}/{fields['target_component']}" if "target_system" in fields else ""
    link = f" on {received.link}" if received.link else ""
    parts = " ".join(f"{key} {_number(fields[key])}" for key in KEYS[received.name])
    return f"{received.name} {parts}{address}{link}"


def _number(value: Any) -> Any:
    """A float to five digits, as recordings have seven; an int32 parameter's bytes are a float, too."""
    is_float = isinstance(value, float)
    return f"{value:.5g}" if is_float else value


def _delay_s(side: Dialogue, reply: Stand) -> float | None:
    """Since the newest message to which it may be the reply; None when there was none."""
    words = reply.value.split()
    asking = _asking(side.sent, words)
    index = bisect.bisect_right(asking, reply.t_s + 1e-6)
    return reply.t_s - asking[index - 1] if index else None


def _asking(sent: tuple[Sent, ...], words: list[str]) -> list[float]:
    if words[0] == "COMMAND_ACK":
        return [one.t_s for one in sent if one.name.startswith("COMMAND") and _commands(one.fields, words[2])]
    prefix = words[0].split("_")[0]
    return [one.t_s for one in sent if one.name.startswith(prefix)]


def _commands(fields: Fields, command: str) -> bool:
    return str(fields["command"]) == command


# The vehicle's own COMMAND_LONGs: a mission's gripper item shows in nothing else but the servo output.


ASPECT = "vehicle's own commands"
SOON_S = 0.26
"""The period that a command is held to: one is sent when something is over, or a quarter of a second later."""
OWN_REPEAT_S = 1.02
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


def _own_commands(side: Dialogue) -> list[ReceivedMessage]:
    return side.broadcast("COMMAND_LONG")


def _firsts(side: Dialogue) -> dict[Stand, float]:
    """The first transmission of each command, with its param7 (0 where that is never set)."""
    return {
        Stand(one.t_s, _said(one), 1): _height_m(one) for one in _own_commands(side) if not one.fields["confirmation"]
    }


def _is_at_boot(received: ReceivedMessage) -> bool:
    """The grab at power-up goes to 0/0, and PX4 leaves all but param2 uninitialised."""
    return not received.fields["target_system"]


def _said(received: ReceivedMessage) -> str:
    fields = received.fields
    numbers = (2,) if _is_at_boot(received) else range(1, 7)
    params = " ".join("nan" if fields[f"param{n}"] is None else f"{fields[f'param{n}']:g}" for n in numbers)
    return f"command {fields['command']} [{params}] to {fields['target_system']}/{fields['target_component']}"


def _height_m(received: ReceivedMessage) -> float:
    height_m = received.fields["param7"]
    return 0.0 if _is_at_boot(received) else math.nan if height_m is None else float(height_m)


def _heights(alignment: Alignment, ours: dict[Stand, float], theirs: dict[Stand, float]) -> Iterator[str]:
    for a, b in alignment.pairs:
        if not abs(ours[a] - theirs[b]) <= HEIGHT_M and not math.isnan(ours[a]) & math.isnan(theirs[b]):
            yield f"{a.value}: param7 {ours[a]:.1f}, simulated {theirs[b]:.1f}"


def _confirmations(side: Dialogue) -> Counter[tuple[str, int]]:
    repeats = (one for one in _own_commands(side) if one.fields["confirmation"])
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
            and (b_s is None or abs(a_s - b_s) > OWN_REPEAT_S)
            and ours[a.value, last] == theirs[a.value, last]
        ):
            after = "not" if b_s is None else f"{b_s:.2f} s"
            yield f"{a.value} confirmation {last} after {a_s:.2f} s, simulated {after}"


def _last_after_s(side: Dialogue, last: int) -> dict[tuple[str, float], float]:
    """From each first transmission to its last repeat, soon after; the boot's first is recorded without a clock."""
    found: dict[tuple[str, float], float] = {}
    ends = [(_said(one), one.t_s) for one in _own_commands(side) if one.fields["confirmation"] == last]
    for one in _own_commands(side):
        if one.fields["confirmation"] or _is_at_boot(one):
            continue
        said, t_s = _said(one), one.t_s
        end = next((end for end in ends if end[0] == said and 0.0 <= end[1] - t_s <= LAST_S), None)
        if end is not None:
            ends.remove(end)
            found[said, t_s] = end[1] - t_s
    return found


# What the vehicle says in words: status texts and events, among them the reasons of a refusal.


SENSOR_CHECKS = ("Preflight Fail", "Preflight: ")
EVENT_NAMES = {event_id: name for name, (event_id, _, _) in EVENTS.items()}
NUMBER = re.compile(r"\d+(?:\.\d+)?")
ROUNDING = 1.0
"""Measured heights in texts are rounded up to whole metres."""


def judge_words(recorded: Dialogue, simulated: Dialogue) -> Iterator[Verdict]:
    """Texts in order, and the events that the simulator knows, in order."""
    ours, theirs = texts(recorded), texts(simulated)
    if ours or theirs:
        links = sorted(
            {received.link for side in (recorded, simulated) for received in side.named("STATUSTEXT")}, key=str
        )
        alignment = joined(align(_spoken(recorded, link), _spoken(simulated, link), short=0) for link in links)
        yield Verdict("status texts", len(ours), alignment.differences)
        pairs = ((_text_at(ours, a), _text_at(theirs, b)) for a, b in alignment.pairs)
        wrong = tuple(f"{a!r}, simulated {b!r}" for a, b in pairs if not _numbers_agree(a, b))
        yield Verdict("numbers in status texts", len(alignment.pairs), wrong)
    ours, theirs = events(recorded), events(simulated)
    if ours or theirs:
        yield Verdict("events", len(ours), align(ours, theirs, short=0).differences)


def texts(side: Dialogue, *links: str | None) -> list[Stand]:
    """Whole texts, their parts joined, without those of the sensors' checks; of all links, or of these."""
    found: list[Stand] = []
    whole: dict[tuple[str | None, int], int] = {}
    for received in side.named("STATUSTEXT"):
        if links and received.link not in links:
            continue
        text, key = received.fields["text"].rstrip("\t"), (received.link, received.fields["id"])
        if received.fields["chunk_seq"] and key in whole:
            first = found[whole[key]]
            found[whole[key]] = Stand(first.t_s, first.value + text, 1)
        else:
            whole[key] = len(found)
            found.append(Stand(received.t_s, f"{_on(received)}{text}", 1))
    return [one for one in found if not any(check in one.value for check in SENSOR_CHECKS)]


def events(side: Dialogue) -> list[Stand]:
    """Names of the events that the simulator knows."""
    received = [one for one in side.broadcast("EVENT") if one.fields["id"] in EVENT_NAMES]
    return [Stand(one.t_s, EVENT_NAMES[one.fields["id"]], 1) for one in received]


def _spoken(side: Dialogue, link: str | None) -> list[Stand]:
    """One link's texts: which of two links tells a text first is chance."""
    return [_blank(one) for one in texts(side, link)]


def _on(received: ReceivedMessage) -> str:
    return f"on {received.link}: " if received.link else ""


def _blank(text: Stand) -> Stand:
    """Numbers are compared by themselves, except those that count items."""
    measured = " m" in text.value
    return Stand(text.t_s, NUMBER.sub("#", text.value) if measured else text.value, text.count)


def _text_at(spoken: list[Stand], blank: Stand) -> str:
    return next(one.value for one in spoken if one.t_s == blank.t_s and _blank(one) == blank)


def _numbers_agree(a: str, b: str) -> bool:
    pairs = zip(NUMBER.findall(a), NUMBER.findall(b), strict=True)
    return all(abs(float(x) - float(y)) <= ROUNDING for x, y in pairs)
