"""What can be set of webhooks."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field

from app.domain.webhooks.backoff import Backoff


@dataclass(frozen=True, slots=True, kw_only=True)
class WebhookSettings:
    """`http_anywhere` allows plain http to other machines. `chance` is the random part of each wait, in [0, 1).

    `queue_events` bounds what waits in memory for a slow receiver, `page_events` what is read from the disk at once.
    A cursor that moved over events of no interest is stored each `save_each_events`; while a webhook catches up it is
    stored each `save_each_s` at most: each time is a sync of the disk, for which the journal's next commit waits.
    `disk_again_s`: after an error of the disk the journal is read again.
    """

    backoff: Backoff = field(default_factory=Backoff)
    http_anywhere: bool = False
    queue_events: int = 256
    page_events: int = 50
    save_each_events: int = 500
    save_each_s: float = 0.5
    disk_again_s: float = 5.0
    chance: Callable[[], float] = random.random
