"""Lays two sequences of values beside each other.

Values are sampled at the period of the message that shows them. One that a side showed only once may have been too
short to be seen at all on the other side, so it may be missing there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher

from app.simulator.compare.judging.verdict import times_agree
from app.simulator.compare.sides import Stand


@dataclass(frozen=True, slots=True)
class Alignment:
    """`pairs` are the stands that both sides have; `differences` what only one has and was not too short."""

    pairs: tuple[tuple[Stand, Stand], ...]
    differences: tuple[str, ...]


def align(recorded: Sequence[Stand], simulated: Sequence[Stand], short: int = 1) -> Alignment:
    """`short`: a stand of at most so many messages may be missing on the other side; 0 for none."""
    matcher = SequenceMatcher(None, [one.value for one in recorded], [one.value for one in simulated], autojunk=False)
    pairs: list[tuple[Stand, Stand]] = []
    differences: list[str] = []
    for tag, i, i_end, j, j_end in matcher.get_opcodes():
        if tag == "equal":
            pairs.extend(zip(recorded[i:i_end], simulated[j:j_end], strict=True))
            continue
        missing = [one for one in recorded[i:i_end] if one.count > short]
        extra = [one for one in simulated[j:j_end] if one.count > short]
        if missing or extra:
            differences.append(_said(missing, extra))
    return Alignment(tuple(pairs), tuple(differences))


def _said(missing: list[Stand], extra: list[Stand]) -> str:
    if not extra:
        return f"missing: {_listed(missing)}"
    if not missing:
        return f"extra: {_listed(extra)}"
    return f"recorded {_listed(missing)}; simulated {_listed(extra)}"


def _listed(values: list[Stand]) -> str:
    return ", ".join(f"{one.value} at {one.t_s:.1f} s" for one in values)


def late(alignment: Alignment, period_s: float) -> list[str]:
    """Stands that began too early or too late, counted from the stand before; both ends are sampled."""
    found = []
    for before, pair in zip(alignment.pairs, alignment.pairs[1:], strict=False):
        recorded_s, simulated_s = pair[0].t_s - before[0].t_s, pair[1].t_s - before[1].t_s
        if not times_agree(recorded_s, simulated_s, period_s):
            found.append(f"{pair[0].value} after {before[0].value}: {recorded_s:.2f} s, simulated {simulated_s:.2f} s")
    return found
