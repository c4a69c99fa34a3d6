"""Of a union without a tag pydantic says what is wrong with each branch; told is only the one that was meant."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from app.domain.validation.fault import Fault
from app.domain.validation.places import Path
from app.domain.validation.words import near_name

MAX_COMPARED: Final = 10
"""Unknown fields whose names are looked at; a document may have thousands."""
Branches = dict[str, list[Fault]]


def of_nearest_forms(faults: Sequence[Fault]) -> list[Fault]:
    """The faults without those of branches that were not meant: of another kind, with more faults, or farther names."""
    nearest = list(faults)
    for depth in range(max((len(fault.place.forms) for fault in faults), default=0)):
        nearest = list(_of_depth(nearest, depth))
    return nearest


def _of_depth(faults: Sequence[Fault], depth: int) -> Iterator[Fault]:
    unions: dict[Path, Branches] = {}
    for fault in faults:
        if len(fault.place.forms) > depth:
            form = fault.place.forms[depth]
            unions.setdefault(form.union, {}).setdefault(form.label, []).append(fault)
    done: set[Path] = set()
    for fault in faults:
        if len(fault.place.forms) <= depth:
            yield fault
            continue
        union = fault.place.forms[depth].union
        if union not in done:
            done.add(union)
            yield from _meant(unions[union], depth)


def _meant(branches: Branches, depth: int) -> list[Fault]:
    ranked = sorted(
        branches.values(), key=lambda found: (_is_other_kind(found, depth), len(found), -_nearly_named(found))
    )
    meant = ranked[0]
    if _is_other_kind(meant, depth):
        wanted = dict.fromkeys(kind for found in ranked for fault in found for kind in fault.wanted)
        return [replace(meant[0], wanted=tuple(wanted))]
    equal = [found for found in ranked[1:] if len(found) == len(meant) and not _is_other_kind(found, depth)]
    instead = tuple([str(fault.place.path[-1]) for fault in equal[0] if fault.kind == "missing"]) if equal else ()
    return [replace(fault, instead=instead) if fault.kind == "missing" else fault for fault in meant]


def _is_other_kind(branch: Sequence[Fault], depth: int) -> bool:
    """Whether the value as a whole is not of the branch's kind: a number for an object."""
    return any(fault.wanted and fault.place.path == fault.place.forms[depth].path for fault in branch)


def _nearly_named(branch: Sequence[Fault]) -> int:
    """How many unknown fields are probably misspelt ones of this branch."""
    unknown = [fault.place for fault in branch if fault.kind == "extra_forbidden"][:MAX_COMPARED]
    return sum(near_name(str(place.path[-1]), place.fields) is not None for place in unknown)
