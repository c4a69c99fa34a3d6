"""The comparison as text: a table of scenarios, then the differences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatch

from app.simulator.compare.judge import Judgement
from app.simulator.compare.known import KNOWN, Known


def lines(judgements: Sequence[Judgement]) -> Iterator[str]:
    """Line by line."""
    yield f"{'scenario':<27} {'compared':>8} {'known':>6} {'new':>4}"
    for judgement in judgements:
        known = sum(difference.reason is not None for difference in judgement.differences)
        new = len(judgement.differences) - known
        verdict = "agrees" if not judgement.differences else "differs as known" if not new else "DIFFERS"
        compared = sum(judgement.aspects.values())
        yield f"{judgement.scenario:<27} {compared:>8} {known:>6} {new:>4}  {verdict}"
    yield f"agree or differ as known: {sum(one.agrees for one in judgements)} of {len(judgements)}"
    for judgement in judgements:
        yield from _details(judgement)
    for entry in KNOWN:
        if _is_over(entry, judgements):
            yield f"no longer seen, take it out of the known ones: {entry.scenario}: {entry.aspect}: {entry.what}"


def _is_over(known: Known, judgements: Sequence[Judgement]) -> bool:
    """Whether its scenario was replayed and the known difference did not show."""
    replayed = [judgement for judgement in judgements if fnmatch(judgement.scenario, known.scenario)]
    return bool(replayed) and not any(
        known.covers(judgement.scenario, difference.aspect, difference.what)
        for judgement in replayed
        for difference in judgement.differences
    )


def _details(judgement: Judgement) -> Iterator[str]:
    if not judgement.differences:
        return
    yield ""
    yield judgement.scenario
    for difference in judgement.differences:
        reason = f" [known: {difference.reason}]" if difference.reason else ""
        yield f"  {difference.aspect}: {difference.what}{reason}"
