"""One gateway has a site: another one with its name begins nothing, ends nothing, and always brings vehicles down."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

import pytest

from app.domain.cluster.lease import Leaseholder, LeaseState, SiteTakenError, SiteUndecidedError
from app.domain.cluster.ports import LeftRun
from app.domain.errors import ConflictError
from app.domain.events import EventKind
from app.domain.run.run import RunState
from app.services import handover, site_lease
from app.services.jobs.views import JobRequest
from app.services.journal import Journal
from app.services.site_lease import SiteLease
from app.services.vehicle_commands import VehicleCommands
from tests.support.events import data_of
from tests.support.fakes import ManualClock, MemoryEventStore
from tests.support.job_service import job_service
from tests.support.memory_cluster import MemoryBus, NoHandover

SITE = "north"
SOON_S = 20.0
OTHER = Leaseholder(gateway="gw-2", address="x", system_id=246, has_standby=True).model_dump_json().encode()


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leases are looked at often."""
    monkeypatch.setattr(site_lease, "RENEWED_EVERY_S", 0.01)
    monkeypatch.setattr(handover, "AGAIN_S", 0.01)
    monkeypatch.setattr(handover, "ASKED_AGAIN_S", 0.05)


@asynccontextmanager
async def journal(events: MemoryEventStore, clock: ManualClock) -> AsyncIterator[Journal]:
    one = Journal(events, clock)
    await one.start()
    try:
        yield one
    finally:
        await one.close()


class Rig:
    """Gateways of one site on one bus."""

    def __init__(self) -> None:
        self.bus = MemoryBus()
        self.clock = ManualClock()
        self.events = MemoryEventStore()
        self.handover = NoHandover()

    def lease(self, journal: Journal, name: str = "gw-1", address: str = "here", *, standby: bool = False) -> SiteLease:
        me = Leaseholder(gateway=name, address=address, system_id=245, has_standby=standby)
        return SiteLease(SITE, me, journal, self.bus, self.clock, self.handover)

    def stand_still(self) -> None:
        """The process is suspended for longer than a lease lasts."""
        self.clock.time_s += 60.0

    @asynccontextmanager
    async def gateway(self, name: str, address: str = "", *, standby: bool = False) -> AsyncIterator[SiteLease]:
        async with journal(self.events, self.clock) as one:
            lease = self.lease(one, name, address or name, standby=standby)
            async with lease.kept():
                yield lease

    @asynccontextmanager
    async def gateway_after_another(self, name: str) -> AsyncIterator[SiteLease]:
        """The lease of the other gateway has expired, and a person is waited for."""
        await self.bus.write_lease(SITE, OTHER, after=0)
        async with self.gateway(name) as lease:
            self.bus.expire(SITE)
            await until(lambda: states(lease) == [LeaseState.EXPIRED])
            yield lease


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(SOON_S):
        while not holds():
            await asyncio.sleep(0.005)


def left_run(number: int, gateway: str = "gw-2") -> LeftRun:
    return LeftRun(run_id=f"run-{number}", vehicle_id=f"north-v{number}", gateway=gateway, is_over=False)


async def looked_again(rig: Rig) -> None:
    """The lease was looked at twice since now."""
    before = rig.handover.looks
    await until(lambda: rig.handover.looks >= before + 2)


def states(*leases: SiteLease) -> list[LeaseState]:
    return [lease.claim.state for lease in leases]


def told(rig: Rig) -> list[str | None]:
    return [data_of(one)["taken_by"] for one in rig.events.events if one.kind is EventKind.SERVICE_SITE_LEASE]


def recorded(rig: Rig) -> list[tuple[str | None, bool]]:
    changes = [data_of(one) for one in rig.events.events if one.kind is EventKind.SERVICE_SITE_LEASE]
    return [(one["taken_by"], one["has_expired"]) for one in changes]


async def test_the_first_gateway_has_the_site_and_the_second_one_when_the_first_is_stopped() -> None:
    rig = Rig()
    async with rig.gateway("gw-2") as second, rig.gateway("gw-1") as third:
        assert states(second, third) == [LeaseState.HELD, LeaseState.TAKEN]
        assert isinstance(third.why_no_new_work(), SiteTakenError)
        assert second.why_no_new_work() is None
    async with rig.gateway("gw-1") as first:
        assert states(first) == [LeaseState.HELD], "a gateway that stops gives its site up"
        assert told(rig) == ["gw-2"]


async def test_a_gateway_learns_that_its_lease_was_taken_and_takes_it_again_when_it_is_free() -> None:
    rig = Rig()
    async with rig.gateway("gw-1") as lease:
        rig.bus.expire(SITE)
        await rig.bus.write_lease(SITE, OTHER, after=0)
        await until(lambda: states(lease) == [LeaseState.TAKEN])
        rig.handover.silent = True
        rig.bus.expire(SITE)
        await until(lambda: states(lease) == [LeaseState.HELD])
        await until(lambda: told(rig) == ["gw-2", None])


async def test_a_lease_that_expired_is_taken_only_when_its_gateway_is_silent_on_the_links() -> None:
    rig = Rig()
    async with rig.gateway_after_another("gw-1") as lease:
        rig.handover.left = (left_run(1),)
        await looked_again(rig)
        assert (states(lease), rig.handover.taken) == ([LeaseState.EXPIRED], [])
        assert isinstance(lease.why_no_new_work(), SiteTakenError)
        assert not lease.may_command()
        rig.handover.is_answered = False
        rig.handover.silent = True
        await looked_again(rig)
        assert states(lease) == [LeaseState.EXPIRED], "nobody says which runs are left"
        rig.handover.is_answered = True
        rig.handover.fails = {"run-1": 1}
        rig.handover.gate.clear()
        await until(lambda: states(lease) == [LeaseState.HELD])
        assert isinstance(lease.why_no_new_work(), SiteUndecidedError), "a run is not taken over yet"
        rig.handover.gate.set()
        await until(lambda: lease.why_no_new_work() is None)
        await until(lambda: rig.handover.taken == ["run-1"])


async def test_a_person_lets_a_gateway_take_over_and_only_when_the_lease_has_expired() -> None:
    rig = Rig()
    await rig.bus.write_lease(SITE, OTHER, after=0)
    async with rig.gateway("gw-1") as lease:
        with pytest.raises(ConflictError):
            await lease.take_over()
        rig.bus.expire(SITE)
        await until(lambda: states(lease) == [LeaseState.EXPIRED])
        assert (await lease.take_over()).claim.state is LeaseState.HELD
        expected = [("gw-2", False), ("gw-2", True), (None, False)]
        await until(lambda: recorded(rig) == expected)
        with pytest.raises(ConflictError):
            await lease.take_over()


async def test_a_person_is_told_of_a_takeover_once_the_runs_are_taken_over_or_which_are_not() -> None:
    rig = Rig()
    rig.handover.left = (left_run(1), left_run(2))
    async with rig.gateway_after_another("gw-1") as lease:
        rig.handover.fails = {"run-1": 3}
        assert (await lease.take_over()).left_run_ids == (), "a run that fails at first is waited for"
        assert sorted(rig.handover.taken) == ["run-1", "run-2"]


async def test_a_run_that_cannot_be_taken_over_is_named_to_the_person_who_lets_a_gateway_take_over(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(site_lease, "TAKEN_OVER_S", 0.5)
    rig = Rig()
    rig.handover.left = (left_run(1), left_run(2))
    async with rig.gateway_after_another("gw-1") as lease:
        rig.handover.fails = {"run-1": 1_000_000}
        taken = await lease.take_over()
        assert (taken.claim.state, taken.left_run_ids) == (LeaseState.HELD, ("run-1",))
        rig.handover.fails = {}
        await until(lambda: sorted(rig.handover.taken) == ["run-1", "run-2"])


async def test_a_person_is_told_at_once_that_the_other_gateway_is_back_while_its_runs_are_taken_over() -> None:
    rig = Rig()
    rig.handover.left = (left_run(1),)
    async with rig.gateway_after_another("gw-1") as lease:
        rig.handover.gate.clear()
        asked = asyncio.create_task(lease.take_over())
        await until(lambda: states(lease) == [LeaseState.HELD])
        rig.bus.expire(SITE)
        await rig.bus.write_lease(SITE, OTHER, after=0)
        async with asyncio.timeout(site_lease.TAKEN_OVER_S / 2):
            with pytest.raises(ConflictError):
                await asked
        rig.handover.gate.set()


async def test_a_gateway_that_comes_back_while_its_lease_has_only_expired_has_its_site_again() -> None:
    rig = Rig()
    async with rig.gateway_after_another("gw-1") as lease:
        await rig.bus.write_lease(SITE, OTHER, after=0)
        await until(lambda: states(lease) == [LeaseState.TAKEN])


async def test_a_gateway_that_starts_when_another_one_has_left_runs_does_not_have_the_site_by_that() -> None:
    rig = Rig()
    rig.handover.left = (left_run(1),)
    async with rig.gateway("gw-1") as lease:
        assert states(lease) == [LeaseState.EXPIRED]
        assert (await lease.take_over()).claim.state is LeaseState.HELD
        await until(lambda: rig.handover.taken == ["run-1"])


async def test_the_next_process_on_a_data_folder_has_its_lease_at_once_and_a_copy_of_the_folder_does_not() -> None:
    rig = Rig()
    async with rig.gateway("gw-1", "here") as before:
        async with rig.gateway("gw-1", "copied") as copy:
            assert states(before, copy) == [LeaseState.HELD, LeaseState.TAKEN]
            assert not copy.claim.may_relay("gw-1")
            assert (before.may_command(), copy.may_command()) == (True, False)
        async with rig.gateway("gw-1", "here") as after:
            assert states(after) == [LeaseState.HELD]


async def test_an_expired_lease_lets_a_copy_of_a_journal_command_nothing_until_a_person_restarts_it() -> None:
    rig = Rig()
    holder = Leaseholder(gateway="gw-1", address="here")
    await rig.bus.write_lease(SITE, holder.model_dump_json().encode(), after=0)
    async with rig.gateway("gw-1", "copied") as copy:
        assert (states(copy), copy.may_command()) == ([LeaseState.TAKEN], False)
        rig.bus.expire(SITE)
        await until(lambda: states(copy) == [LeaseState.EXPIRED])
        assert (await copy.take_over()).claim.state is LeaseState.HELD
        assert not copy.may_command()
    async with rig.gateway("gw-1", "copied") as restarted:
        assert restarted.may_command()


async def test_without_nats_a_gateway_works_alone_and_takes_its_site_once_it_can() -> None:
    rig = Rig()
    rig.bus.down = True
    async with rig.gateway("gw-1") as lease:
        assert states(lease) == [LeaseState.ALONE]
        assert lease.why_no_new_work() is None
        rig.bus.down = False
        await until(lambda: states(lease) == [LeaseState.HELD])
        rig.bus.down = True
        await until(lambda: states(lease) == [LeaseState.ALONE])


async def test_a_process_that_stood_still_holds_nothing_until_it_has_asked() -> None:
    rig = Rig()
    async with rig.gateway("gw-1") as lease:
        rig.clock.time_s += 60.0
        assert (states(lease), lease.may_command()) == ([LeaseState.UNDECIDED], False)
        await until(lambda: states(lease) == [LeaseState.HELD])


async def test_a_part_runs_while_the_claim_allows_it() -> None:
    rig, running = Rig(), asyncio.Event()

    @asynccontextmanager
    async def part() -> AsyncIterator[None]:
        running.set()
        yield
        running.clear()

    async with rig.gateway("gw-1") as lease:
        task = asyncio.create_task(lease.while_allowed(lambda claim: claim.state is LeaseState.HELD, part))
        try:
            await until(running.is_set)
            rig.bus.down = True
            await until(lambda: not running.is_set())
            rig.bus.down = False
            await until(running.is_set)
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)


async def test_a_gateway_without_its_site_ends_no_run_begins_none_and_brings_vehicles_down() -> None:
    rig = Rig()
    async with job_service(2, site=SITE) as service, rig.gateway("gw-other"):
        flying, waiting = service.vehicles
        run = await service.runs.create("plan-1", "north-v1", start=True, actor="anna")
        await service.until(lambda: service.events.runs[run.id].state is RunState.FLYING, "it must take off")
        lease = rig.lease(service.journal)
        async with lease.kept():
            service.fleet.gate_new_work(lease.why_no_new_work)
            with pytest.raises(SiteTakenError):
                await service.runs.create("plan-1", "north-v2", start=True, actor="anna")
            with pytest.raises(SiteTakenError):
                await service.runs.change_mission(run.id, "plan-1", None, "anna")
            order = JobRequest.model_validate({"plan": "plan-1", "vehicle": "north-v2", "min_battery_percent": 0})
            refusals = [
                refusal.code for one in (await service.jobs.check(order)).candidates for refusal in one.refusals
            ]
            assert "vehicle.site_not_held" in refusals
            assert not service.events.runs[run.id].is_over
            await service.runs.return_to_launch(run.id)
            await VehicleCommands(service.fleet, service.journal).hold("north-v2", "anna")
            assert (flying.sent[-1], waiting.sent[-1], service.armed()) == ("return", "hold", 1)


async def test_a_prepared_run_is_not_started_while_another_gateway_has_the_site() -> None:
    rig = Rig()
    async with job_service(site=SITE) as service, rig.gateway("gw-other"):
        run = await service.runs.create("plan-1", "north-v1", start=False, actor="anna")
        await service.until(lambda: service.events.runs[run.id].state is RunState.UPLOADED, "it must be uploaded")
        lease = rig.lease(service.journal)
        async with lease.kept():
            service.fleet.gate_new_work(lease.why_no_new_work)
            with pytest.raises(SiteTakenError):
                await service.runs.start(run.id)
            assert service.armed() == 0


# what a hostile reading found ----------------------------------------------------------------------------------


async def test_a_lease_that_expired_of_a_gateway_without_a_standby_is_taken_by_a_person_alone() -> None:
    rig = Rig()
    plain = Leaseholder(gateway="gw-2", address="x", system_id=246).model_dump_json().encode()
    await rig.bus.write_lease(SITE, plain, after=0)
    rig.handover.silent = True
    async with rig.gateway("gw-1") as lease:
        rig.bus.expire(SITE)
        await until(lambda: states(lease) == [LeaseState.EXPIRED])
        assert (await lease.take_over()).claim.state is LeaseState.HELD


async def test_with_a_standby_a_gateway_that_stood_still_commands_nothing_until_it_reads_the_lease() -> None:
    rig = Rig()
    async with rig.gateway("gw-1", standby=True) as lease:
        rig.bus.down = True
        await until(lambda: states(lease) == [LeaseState.ALONE])
        assert lease.may_command(), "it has not stood still"
        rig.clock.time_s += 6.0
        for _ in range(2):
            assert (states(lease), lease.may_command()) == ([LeaseState.UNDECIDED], False)
            await asyncio.sleep(0.05)
        rig.bus.down = False
        await until(lease.may_command)


async def test_with_a_standby_a_gateway_alone_that_loses_a_vehicle_commands_nothing_until_it_reads_the_lease() -> None:
    rig = Rig()
    async with rig.gateway("gw-1", standby=True) as lease:
        rig.handover.lost = True
        assert lease.may_command(), "it renews its lease"
        rig.bus.down = True
        await until(lambda: not lease.may_command())
        rig.handover.lost = False
        await asyncio.sleep(0.05)
        assert not lease.may_command(), "the standby may have taken over meanwhile"
        rig.bus.down = False
        await until(lease.may_command)


async def test_with_a_standby_a_gateway_that_starts_is_not_alone_and_asks_who_follows_its_runs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(site_lease, "DECIDED_S", 0.2)  # nobody answers
    rig = Rig()
    rig.handover.is_answered = False
    async with rig.gateway("gw-1", standby=True) as lease:
        assert (states(lease), lease.may_command()) == ([LeaseState.UNDECIDED], False)
        rig.handover.is_answered = True
        await until(lambda: states(lease) == [LeaseState.HELD])


async def test_a_run_that_cannot_be_taken_over_holds_up_no_other_and_is_tried_until_it_is() -> None:
    rig = Rig()
    await rig.bus.write_lease(SITE, OTHER, after=0)
    async with rig.gateway("gw-1") as lease:
        rig.bus.expire(SITE)
        rig.handover.left, rig.handover.fails = (left_run(1), left_run(2), left_run(3)), {"run-2": 1_000_000}
        rig.handover.silent = True
        await until(lambda: rig.handover.taken == ["run-1", "run-3"] and lease.why_no_new_work() is None)
        assert [lease.is_left(f"run-{number}") for number in (1, 2, 3)] == [False, True, False]
        rig.handover.fails = {}
        await until(lambda: not lease.is_left("run-2"))
        assert rig.handover.taken == ["run-1", "run-3", "run-2"]


async def test_runs_that_are_left_are_not_forgotten_when_the_lease_lapses_meanwhile() -> None:
    rig = Rig()
    await rig.bus.write_lease(SITE, OTHER, after=0)
    async with rig.gateway("gw-1") as lease:
        rig.bus.expire(SITE)
        rig.handover.left, rig.handover.fails = (left_run(1),), {"run-1": 1_000_000}
        rig.handover.silent = True
        await until(lambda: states(lease) == [LeaseState.HELD])
        rig.handover.silent = rig.handover.is_answered = False
        rig.clock.time_s += 20.0
        rig.bus.expire(SITE)
        await until(lambda: states(lease) == [LeaseState.HELD])
        rig.handover.fails, rig.handover.is_answered = {}, True
        await until(lambda: rig.handover.taken == ["run-1"])


async def test_runs_that_arrive_late_are_taken_over_too() -> None:
    rig = Rig()
    await rig.bus.write_lease(SITE, OTHER, after=0)
    async with rig.gateway("gw-1"):
        rig.bus.expire(SITE)
        rig.handover.left, rig.handover.silent = (left_run(1),), True
        await until(lambda: rig.handover.taken == ["run-1"])
        rig.handover.left = (left_run(2),)
        await until(lambda: rig.handover.taken[:2] == ["run-1", "run-2"])


async def test_a_gateway_that_gives_its_site_up_commands_nothing_any_more() -> None:
    rig = Rig()
    async with rig.gateway("gw-1") as lease:
        assert lease.may_command()
    assert not lease.may_command()
    assert lease.why_no_new_work() is not None


async def test_a_person_learns_that_the_other_gateway_is_back() -> None:
    rig = Rig()
    async with rig.gateway_after_another("gw-1") as lease:
        rig.handover.is_answered = False
        asked = asyncio.create_task(lease.take_over())
        await asyncio.sleep(0.05)
        await rig.bus.write_lease(SITE, OTHER, after=0)
        with pytest.raises(ConflictError):
            await asked


async def test_with_a_standby_a_gateway_that_stood_still_while_it_asked_commands_nothing() -> None:
    rig = Rig()
    async with rig.gateway("gw-1", standby=True) as lease:
        rig.bus.down = True
        await until(lambda: states(lease) == [LeaseState.ALONE])
        rig.bus.before_refusal = rig.stand_still
        await until(lambda: states(lease) == [LeaseState.UNDECIDED])
        assert not lease.may_command(), "the standby may have taken over while this process stood still"


async def test_own_runs_are_reclaimed_where_a_standby_may_have_followed_them_and_only_there() -> None:
    rig = Rig()
    async with rig.gateway("gw-1", standby=True) as lease:
        assert rig.handover.reclaimed == [""], "it starts, and the lease of an earlier process has expired"
        rig.bus.down = True
        await until(lambda: states(lease) == [LeaseState.ALONE])
        rig.bus.down = False
        await until(lambda: states(lease) == [LeaseState.HELD])
        assert rig.handover.reclaimed == [""], "it was alone all the time"
        rig.bus.down = True
        rig.clock.time_s += 6.0
        rig.bus.expire(SITE)
        rig.bus.down = False
        await until(lambda: states(lease) == [LeaseState.HELD])
        assert rig.handover.reclaimed == ["", ""], "it stood still"
    async with rig.gateway("gw-1", standby=False):
        assert rig.handover.reclaimed == ["", ""], "it gave its lease up itself"


async def test_own_runs_are_reclaimed_also_if_the_answer_to_the_writing_of_the_lease_is_lost() -> None:
    rig = Rig()
    async with rig.gateway("gw-1", standby=True) as lease:
        rig.bus.down = True
        rig.clock.time_s += 6.0
        rig.bus.expire(SITE)
        rig.bus.loses_written = 1
        rig.bus.down = False
        await until(lambda: states(lease) == [LeaseState.HELD])
        assert rig.handover.reclaimed == ["", ""], "at its start, and after it stood still"


async def test_of_two_followers_of_a_site_none_is_silent_because_its_runs_were_taken_over_before() -> None:
    rig = Rig()
    rig.handover.left = (left_run(1),)
    async with rig.gateway("gw-1", standby=True) as lease:
        await until(lambda: states(lease) == [LeaseState.EXPIRED])
        assert (await lease.take_over()).claim.state is LeaseState.HELD
        rig.handover.left = (left_run(2),)
        rig.clock.time_s += 6.0
        rig.bus.expire(SITE)
        await until(lambda: states(lease) == [LeaseState.EXPIRED])
