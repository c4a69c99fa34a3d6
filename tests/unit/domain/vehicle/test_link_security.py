"""Of two levels of protection the weaker one counts."""

from __future__ import annotations

import pytest

from app.domain.vehicle.link_security import LinkSecurity, weaker


@pytest.mark.parametrize(
    ("one", "other", "weakest"),
    [
        (LinkSecurity.SIGNED, LinkSecurity.PINNED, LinkSecurity.PINNED),
        (LinkSecurity.OPEN, LinkSecurity.SIGNED, LinkSecurity.OPEN),
        (LinkSecurity.PINNED, LinkSecurity.PINNED, LinkSecurity.PINNED),
        (None, LinkSecurity.SIGNED, LinkSecurity.SIGNED),
        (LinkSecurity.OPEN, None, LinkSecurity.OPEN),
        (None, None, None),
    ],
)
def test_the_weaker_one(one: LinkSecurity | None, other: LinkSecurity | None, weakest: LinkSecurity | None) -> None:
    assert weaker(one, other) is weakest
