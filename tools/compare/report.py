"""The comparison as text: a table of scenarios, then the differences."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from fnmatch import fnmatch

from tools.compare.judge import Judgement
from tools.compare.known import KNOWN, Known
from tools.compare.release import Release


def lines(judgements: Sequence[Judgement], verbose: bool = False) -> Iterator[str]:
    """Line by line; `verbose` names the aspects that agree."""
    yield f"{'scenario':<27} {'compared':>8} {'aspects agree':>14} {'known':>6} {'new':>4}"
    for judgement in judgements:
        known = sum(difference.reason is not None for difference in judgement.differences)
        new = len(judgement.differences) - known
        verdict = "agrees" if not judgement.differences else "differs as known" if not new else "DIFFERS"
        aspects = f"{len(judgement.agreeing)} of {len(judgement.aspects)}"
        compared = sum(judgement.aspects.values())
        yield f"{judgement.scenario:<27} {compared:>8} {aspects:>14} {known:>6} {new:>4}  {verdict}"
    yield f"agree or differ as known: {sum(one.agrees for one in judgements)} of {len(judgements)}"
    yield from _releases(judgements)
    if verbose:
        yield from _aspects(judgements)
    for judgement in judgements:
        yield from _details(judgement)
    for entry in KNOWN:
        if _is_over(entry, judgements):
            yield f"no longer seen, take it out of the known ones: {entry.scenario}: {entry.aspect}: {entry.what}"


def _releases(judgements: Sequence[Judgement]) -> Iterator[str]:
    """Where each release was: metres from the drop point, ground speed, and how far apart the two were."""
    rows = [(one.scenario, *pair) for one in judgements for pair in one.releases]
    if not rows:
        return
    yield ""
    yield f"{'release':<27} {'recorded':>17} {'simulated':>19} {'apart':>9}"
    for scenario, ours, theirs in rows:
        apart_m = math.dist((ours.north_m, ours.east_m), (theirs.north_m, theirs.east_m))
        yield f"{scenario:<27} {_place(ours)}   {_place(theirs)} {apart_m:>7.1f} m"


def _place(release: Release) -> str:
    return f"{release.distance_m:>6.1f} m {release.speed_m_s:>4.1f} m/s"


def _aspects(judgements: Sequence[Judgement]) -> Iterator[str]:
    yield ""
    yield "aspects that agree, and how many things were compared in each"
    for judgement in judgements:
        counted = [f"{aspect} {judgement.aspects[aspect]}" for aspect in judgement.agreeing]
        head = f"{judgement.scenario:<27} "
        yield from textwrap.wrap(", ".join(counted) or "none", 120, initial_indent=head, subsequent_indent=" " * 28)


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
