"""Whether a document can be a plan at all, seen from afar.

pydantic names every fault, and holds everything else in the process up meanwhile, also from a thread: a million of them
would cost the vehicles flown by setpoints theirs. So what is far from a plan is refused before pydantic looks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Set
from typing import Any, Final

from app.domain.finding import json_pointer
from app.domain.plan.json_tree import JsonTree
from app.domain.plan.size_limits import MAX_FINDINGS, MAX_ITEMS, MAX_VERTICES

MAX_ENTRIES: Final = max(MAX_ITEMS, MAX_VERTICES)
_MEND: Final = "take it away, or see `waydrop schema`"
Place = tuple[str | int, ...]


def check_outline(tree: JsonTree, known: Callable[[], Set[str]]) -> None:
    """Writes down what is wrong with the outline: no object, far too long lists, or MAX_FINDINGS of what no plan has.

    `known` are the names of all fields of the format. What is wrong in few places is left to the models' own check.
    """
    if not isinstance(tree.value, dict):
        tree.refuse("plan.not_an_object", "", "a plan is a JSON object")
        return
    names = known()
    strange = JsonTree()
    for place, value in _places(tree.value, names):
        if isinstance(value, list) and len(value) > MAX_ENTRIES:
            tree.refuse(
                "plan.too_many_items",
                json_pointer(*place),
                f"{len(value)} {place[-1]}, at most {MAX_ENTRIES} are taken",
            )
        if isinstance(place[-1], str) and place[-1] not in names:
            strange.refuse("plan.unknown_field", json_pointer(*place), f"unknown field {place[-1]!r}", _MEND)
        elif isinstance(place[-1], int) and not isinstance(value, dict):
            strange.refuse("plan.wrong_type", json_pointer(*place), "this must be an object")
        if len(strange.findings) + len(tree.findings) >= MAX_FINDINGS:
            tree.findings += strange.findings
            return


def _places(value: dict[str, Any] | list[Any], names: Set[str], at: Place = ()) -> Iterator[tuple[Place, Any]]:
    """Everything in a document with its place; what is in an unknown field is not looked at, as pydantic does not.

    It is not nested deeper than JsonTree allows.
    """
    entries = value.items() if isinstance(value, dict) else enumerate(value[: MAX_ENTRIES + 1])
    for key, entry in entries:
        place = (*at, key)
        yield place, entry
        if isinstance(entry, (dict, list)) and (isinstance(key, int) or key in names):
            yield from _places(entry, names, place)
