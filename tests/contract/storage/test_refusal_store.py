"""What every RefusalStore promises."""

from __future__ import annotations

from app.domain.audit import MOST_REFUSALS, RejectedRequests
from tests.contract.storage.conftest import Opener, Stores


def refusal(number: int, actor: str = "desk") -> RejectedRequests:
    return RejectedRequests(
        float(number), actor, "token-1", "127.0.0.1", "start_run", f"/runs/{number}", 409, "state.conflict"
    )


async def test_refusals_survive_a_restart_and_are_read_newest_first(opener: Opener) -> None:
    async with opener() as stores:
        await stores.refusals.add([refusal(1), refusal(2)])
        await stores.refusals.add([refusal(3)])
    async with opener() as stores:
        found = await stores.refusals.newest(before=None, limit=10)
        assert [one for _, one in found] == [refusal(3), refusal(2), refusal(1)]


async def test_pages_have_each_one_once_though_new_ones_come(stores: Stores) -> None:
    await stores.refusals.add([refusal(number) for number in range(7)])
    seen: list[RejectedRequests] = []
    before = None
    while page := await stores.refusals.newest(before=before, limit=2):
        seen += [one for _, one in page]
        before = page[-1][0]
        await stores.refusals.add([refusal(100)])
    assert seen == [refusal(number) for number in reversed(range(7))]


async def test_nothing_to_add_is_nothing(stores: Stores) -> None:
    await stores.refusals.add([])
    assert list(await stores.refusals.newest(before=None, limit=10)) == []


async def test_strangers_displace_no_users_and_the_store_is_bounded(stores: Stores) -> None:
    await stores.refusals.add([refusal(number) for number in range(3)])
    for number in range(3):
        await stores.refusals.add([refusal(number, actor="")] * (MOST_REFUSALS // 2))
    found = [one for _, one in await stores.refusals.newest(before=None, limit=10 * MOST_REFUSALS)]
    assert len([one for one in found if one.actor == ""]) == MOST_REFUSALS
    assert [one for one in found if one.actor] == [refusal(2), refusal(1), refusal(0)]
