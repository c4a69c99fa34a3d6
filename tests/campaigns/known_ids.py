"""Ids of what exists in a service: with made-up ones a request ends at 404, before the code that it is to try."""

from __future__ import annotations

import copy
import random
from collections import defaultdict, deque
from collections.abc import Mapping
from typing import Any, Final

KEPT: Final = 24
"""Ids of a kind: the newest, some of which are over or deleted by now."""
AIMED: Final = 0.85
"""Share of the requests that get ids of what exists."""
NOWHERE: Final = "http://127.0.0.1:9/hook"
"""Where webhooks go: nothing listens there, and no request leaves the machine."""
LEARNED: Final = {
    "plans": ("plan_id", "id"),
    "runs": ("run_id", "id"),
    "continuation": ("run_id", "id"),
    "jobs": ("job_id", "id"),
    "tasks": ("task_id", "id"),
    "webhooks": ("webhook_id", "id"),
    "lease": ("lease", "lease"),
    "attachments": ("sha256", "sha256"),
}
"""Kind of id, and its field in the answer, of what is made by a path that ends so."""
OF_A_VEHICLE: Final = frozenset({"lease", "task_id"})
"""Ids that only make sense together with the vehicle that they belong to."""
FIELDS: Final = {"plan": "plan_id", "vehicle": "vehicle_id", "lease": "lease", "before": "task_id"}
"""Fields of bodies that name something."""
IN_A_QUERY: Final = {"plan": "plan_id", "vehicle": "vehicle_id", "older_than": "run_id"}


class KnownIds:
    """Learns from answers, and puts what it learned into requests.

    `examples` are right bodies, by the end of their path.
    """

    def __init__(self, chance: random.Random, examples: Mapping[str, Any], **at_first: tuple[str, ...]) -> None:
        self._chance = chance
        self._examples = examples
        self._ids: defaultdict[tuple[str, str], deque[str]] = defaultdict(lambda: deque(maxlen=KEPT))
        for kind, ids in at_first.items():
            self._ids[kind, ""].extend(ids)

    def learn(self, path: str, body: Any) -> None:
        """From the answer of a request that succeeded."""
        kind, name = LEARNED.get(path.rpartition("/")[2], ("", ""))
        if not kind or not isinstance(body, dict):
            return
        made = (body.get("webhook") or body.get("task") or body).get(name)
        vehicle = path.partition("/vehicles/")[2].partition("/")[0] if kind in OF_A_VEHICLE else ""
        if isinstance(made, str) and made not in self._ids[kind, vehicle]:
            self._ids[kind, vehicle].append(made)

    def any_of(self, kind: str, vehicle: str = "") -> str | None:
        """One of them, for a lease the newest; None: none is known, or this request is to miss."""
        known = self._ids[kind, vehicle if kind in OF_A_VEHICLE else ""]
        if not known or self._chance.random() > AIMED:
            return None
        return known[-1] if kind == "lease" else self._chance.choice(known)

    def aim(self, case: Any) -> None:
        """Put them into a request that Schemathesis made; what has no id in it stays as it is."""
        vehicle = self.any_of("vehicle_id") or ""
        for places, kinds in ((case.path_parameters, {}), (case.query, IN_A_QUERY)):
            for name in tuple(places or ()):
                known = vehicle if name == "vehicle_id" else self.any_of(kinds.get(name, name), vehicle)
                if known:
                    places[name] = known
        example = self._examples.get(case.path.rpartition("/")[2])
        if example is not None and isinstance(case.body, dict) and self._chance.random() < AIMED:
            altered = self._chance.choice(list(case.body)) if case.body and self._chance.random() < AIMED else ""
            case.body = {**example, **({altered: case.body[altered]} if altered else {})}
        case.body = self.aimed(case.body, vehicle)

    def aimed(self, body: Any, vehicle: str) -> Any:
        """The body of a request, or a frame, with them."""
        if not isinstance(body, dict):
            return body
        body = copy.copy(body)
        for name in body.keys() & FIELDS.keys():
            if (known := self.any_of(FIELDS[name], vehicle)) is not None:
                body[name] = known
        if isinstance(body.get("url"), str):
            body["url"] = NOWHERE
        return body
