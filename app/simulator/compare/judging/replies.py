"""Answers to the ground side: mission protocol, command acks, parameters; what, to whom, how soon."""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterator
from typing import Any

from app.simulator.compare.heard import Dialogue, Fields, Heard, Sent
from app.simulator.compare.judging.alignment import align, joined
from app.simulator.compare.judging.verdict import Verdict, times_agree
from app.simulator.compare.sides import Stand, stands

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
        links = {heard.link for side in (recorded, simulated) for heard in side.named(*names)}
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

    def value(heard: Heard) -> str | None:
        fields = heard.fields
        if "param_id" in fields:
            return _shown(heard) if asked.get(fields["param_id"], math.inf) <= heard.t_s else None
        return _shown(heard) if fields["target_system"] in grounds else None

    return stands((heard for heard in side.named(*names) if heard.link == link), value)


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


def _shown(heard: Heard) -> str:
    fields = heard.fields
    address = f" to {fields['target_system']}/{fields['target_component']}" if "target_system" in fields else ""
    link = f" on {heard.link}" if heard.link else ""
    parts = " ".join(f"{key} {_number(fields[key])}" for key in KEYS[heard.name])
    return f"{heard.name} {parts}{address}{link}"


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
