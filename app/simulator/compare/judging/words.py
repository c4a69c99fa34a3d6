"""What the vehicle says in words: status texts and events, among them the reasons of a refusal."""

from __future__ import annotations

from collections.abc import Iterator

from app.simulator.compare.heard import Dialogue, Heard
from app.simulator.compare.judging.alignment import align
from app.simulator.compare.judging.verdict import Verdict
from app.simulator.compare.sides import Stand
from app.simulator.events import EVENTS

PREFLIGHT = ("Preflight Fail", "Preflight: ")
EVENT_NAMES = {event_id: name for name, (event_id, _, _) in EVENTS.items()}


def judge_words(recorded: Dialogue, simulated: Dialogue) -> Iterator[Verdict]:
    """Texts in order, and the events that the simulator knows, in order."""
    for aspect, collect in (("status texts", texts), ("events", events)):
        ours, theirs = collect(recorded), collect(simulated)
        if ours or theirs:
            yield Verdict(aspect, len(ours), align(ours, theirs, short=0).differences)


def texts(side: Dialogue) -> list[Stand]:
    """Whole texts, their parts joined, without those of the sensors' checks."""
    parts: dict[tuple[str | None, int], Heard] = {}
    order: list[Stand] = []
    for heard in side.named("STATUSTEXT"):
        key = (heard.link, heard.fields["id"])
        text = heard.fields["text"]
        if heard.fields["chunk_seq"] and order:
            order[-1] = Stand(order[-1].t_s, order[-1].value + text, 1)
        elif not text.startswith(PREFLIGHT):
            order.append(Stand(heard.t_s, f"{text}{_on(heard)}", 1))
        parts[key] = heard
    return [Stand(one.t_s, one.value.replace("\t", ""), 1) for one in order]


def events(side: Dialogue) -> list[Stand]:
    """Names of the events that the simulator knows."""
    heard = [one for one in side.broadcast("EVENT") if one.fields["id"] in EVENT_NAMES]
    return [Stand(one.t_s, EVENT_NAMES[one.fields["id"]], 1) for one in heard]


def _on(heard: Heard) -> str:
    return f" (on {heard.link})" if heard.link else ""
