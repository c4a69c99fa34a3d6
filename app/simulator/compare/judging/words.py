"""What the vehicle says in words: status texts and events, among them the reasons of a refusal."""

from __future__ import annotations

import re
from collections.abc import Iterator

from app.simulator.compare.heard import Dialogue, Heard
from app.simulator.compare.judging.alignment import align, joined
from app.simulator.compare.judging.verdict import Verdict
from app.simulator.compare.sides import Stand
from app.simulator.events import EVENTS

SENSOR_CHECKS = ("Preflight Fail", "Preflight: ")
EVENT_NAMES = {event_id: name for name, (event_id, _, _) in EVENTS.items()}
NUMBER = re.compile(r"\d+(?:\.\d+)?")
ROUNDING = 1.0
"""Measured heights in texts are rounded up to whole metres."""


def judge_words(recorded: Dialogue, simulated: Dialogue) -> Iterator[Verdict]:
    """Texts in order, and the events that the simulator knows, in order."""
    ours, theirs = texts(recorded), texts(simulated)
    if ours or theirs:
        links = sorted({heard.link for side in (recorded, simulated) for heard in side.named("STATUSTEXT")}, key=str)
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
    for heard in side.named("STATUSTEXT"):
        if links and heard.link not in links:
            continue
        text, key = heard.fields["text"].rstrip("\t"), (heard.link, heard.fields["id"])
        if heard.fields["chunk_seq"] and key in whole:
            first = found[whole[key]]
            found[whole[key]] = Stand(first.t_s, first.value + text, 1)
        else:
            whole[key] = len(found)
            found.append(Stand(heard.t_s, f"{_on(heard)}{text}", 1))
    return [one for one in found if not any(check in one.value for check in SENSOR_CHECKS)]


def events(side: Dialogue) -> list[Stand]:
    """Names of the events that the simulator knows."""
    heard = [one for one in side.broadcast("EVENT") if one.fields["id"] in EVENT_NAMES]
    return [Stand(one.t_s, EVENT_NAMES[one.fields["id"]], 1) for one in heard]


def _spoken(side: Dialogue, link: str | None) -> list[Stand]:
    """One link's texts: which of two links tells a text first is chance."""
    return [_blank(one) for one in texts(side, link)]


def _on(heard: Heard) -> str:
    return f"on {heard.link}: " if heard.link else ""


def _blank(text: Stand) -> Stand:
    """Numbers are compared by themselves, except those that count items."""
    measured = " m" in text.value
    return Stand(text.t_s, NUMBER.sub("#", text.value) if measured else text.value, text.count)


def _text_at(spoken: list[Stand], blank: Stand) -> str:
    return next(one.value for one in spoken if one.t_s == blank.t_s and _blank(one) == blank)


def _numbers_agree(a: str, b: str) -> bool:
    pairs = zip(NUMBER.findall(a), NUMBER.findall(b), strict=True)
    return all(abs(float(x) - float(y)) <= ROUNDING for x, y in pairs)
