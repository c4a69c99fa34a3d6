"""Uploading a mission: fence, rally points, mission last; each list tried again within a budget and verified."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import aclosing
from dataclasses import dataclass
from typing import Final

from app.domain.errors import LinkError, UploadError, UploadRefusedError
from app.domain.mission import Mission, MissionItem, MissionType
from app.domain.ports.vehicle_link import UploadProgress
from app.vehicles.decoders import MissionAck, MissionCurrentReport
from app.vehicles.encoders import Outgoing
from app.vehicles.event_reasons import Topic
from app.vehicles.inbox import Inbox
from app.vehicles.link_guard.guard import WatchItems
from app.vehicles.list_transfer import ListTransfer
from app.vehicles.mission_wire import (
    PASSING,
    MissionResult,
    WireItem,
    first_difference,
    from_wire,
    mission_checksum,
    result_word,
    to_wire,
)
from app.vehicles.native import NativeSystem
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts

# One upload of one list through mavsdk's mission_raw, watched on the wire.
#
# mavsdk says only that it failed; the vehicle's own MISSION_ACK says why, and the last item that was sent is the one
# that it refused.


_ACK_BEHIND_S = 0.2
"""mavsdk's result may reach the loop before the message it came from."""


@dataclass(frozen=True, slots=True)
class UploadOutcome:
    """How an attempt ended. `result` is mavsdk's, or SILENT if we gave up; `ack` is the vehicle's MISSION_ACK.
    `sent_seq`: the last item that was sent.
    """

    result: str
    ack: MissionAck | None
    sent_seq: int | None
    ended_s: float


class UploadAttempt:
    """Use as `async with`: leaving it early cancels the transfer, on the vehicle too."""

    def __init__(
        self,
        system: NativeSystem,
        inbox: Inbox,
        watch_items: WatchItems,
        settings: LinkSettings,
        mission_type: MissionType,
        items: Sequence[WireItem],
    ) -> None:
        self._system = system
        self._settings = settings
        self._type = mission_type
        self._items = items
        self._loop = asyncio.get_running_loop()
        self._moved = asyncio.Event()
        self._result: str | None = None
        self._ack: MissionAck | None = None
        self._sent_seq: int | None = None
        self._heard_s = time.monotonic()
        self._ends = (watch_items(self._take_item), inbox.on(MissionAck, self._take_ack))

    async def __aenter__(self) -> UploadAttempt:
        self._system.upload(self._type, self._items, self._done_on_thread)
        return self

    async def __aexit__(self, *_exc: object) -> None:
        try:
            if self._result is None:
                self._system.cancel_transfers()
                if not await self._ends_within(self._settings.close_timeout_s):
                    self._result = "SILENT"
        finally:
            for end in self._ends:
                end()

    async def steps(self) -> AsyncGenerator[int, None]:
        """The number of items sent, as it grows; ends with the transfer or after too long a silence."""
        reported = None
        while not await self._ends_within(self._settings.progress_period_s):
            if time.monotonic() - self._heard_s > self._settings.transfer_silence_s:
                self._result = "SILENT"
                self._system.cancel_transfers()
                return
            if self._sent_seq is not None and self._sent_seq != reported:
                reported = self._sent_seq
                yield reported

    async def outcome(self) -> UploadOutcome:
        """How it ended; call it when the steps are over."""
        ended_s = time.monotonic()
        if self._ack is None and self._result not in {"TIMEOUT", "SILENT", "BUSY"}:
            try:
                async with asyncio.timeout(_ACK_BEHIND_S):
                    while self._ack is None:
                        self._moved.clear()
                        await self._moved.wait()
            except TimeoutError:
                pass
        return UploadOutcome(self._result or "SILENT", self._ack, self._sent_seq, ended_s)

    async def _ends_within(self, timeout_s: float) -> bool:
        """Whether mavsdk says meanwhile how it ended."""
        try:
            async with asyncio.timeout(timeout_s):
                while self._result is None:
                    self._moved.clear()
                    await self._moved.wait()
        except TimeoutError:
            return False
        return True

    def _done_on_thread(self, result: str) -> None:
        try:
            self._loop.call_soon_threadsafe(self._done, result)
        except RuntimeError:
            return  # the loop has ended; nobody waits any more

    def _done(self, result: str) -> None:
        self._result = self._result or result
        self._moved.set()

    def _take_item(self, mission_type: int, seq: int) -> None:
        if mission_type == self._type:
            self._sent_seq, self._heard_s = seq, time.monotonic()

    def _take_ack(self, message: MissionAck, _received_s: float) -> None:
        if message.mission_type == self._type and message.target_system == self._system.own_system_id:
            self._ack = message
            self._moved.set()


_REPORT_WITHIN_S: Final = 2.2
"""MISSION_CURRENT comes every second; one may be lost."""
_READ_BACK_ATTEMPTS: Final = 3
UNREACHABLE: Final = "the link is lost: it is unknown whether the vehicle stored the list"


@dataclass(frozen=True, slots=True)
class UploadCheckResult:
    """`verified_by` is "mission_id" or "read_back"; None if the vehicle does not hold the list, `problem` says why."""

    verified_by: str | None
    mission_id: int | None
    problem: str = ""


class UploadCheck:
    """Compares what was sent with what the vehicle says it holds."""

    def __init__(self, inbox: Inbox, lists: ListTransfer, is_connected: Callable[[], bool]) -> None:
        self._inbox = inbox
        self._is_connected = is_connected
        self._lists = lists

    async def after_ack(
        self, mission_type: MissionType, items: Sequence[MissionItem], opaque_id: int
    ) -> UploadCheckResult:
        """The vehicle accepted the upload and named it `opaque_id` (0: this firmware names none)."""
        if opaque_id and opaque_id == mission_checksum(to_wire(items)):
            return UploadCheckResult("mission_id", opaque_id)
        return await self._read_back(mission_type, items, opaque_id or None)

    async def without_ack(self, mission_type: MissionType, items: Sequence[MissionItem]) -> UploadCheckResult:
        """The final ack did not come: lost on its way, or the transfer really broke off."""
        if not self._is_connected():
            return UploadCheckResult(None, None, UNREACHABLE)
        await self._lists.end_open_transfer(mission_type)
        wanted = mission_checksum(to_wire(items))
        if await self._reported(mission_type, wanted):
            return UploadCheckResult("mission_id", wanted)
        return await self._read_back(mission_type, items, None)

    async def _read_back(
        self, mission_type: MissionType, items: Sequence[MissionItem], mission_id: int | None
    ) -> UploadCheckResult:
        problem = ""
        for _ in range(_READ_BACK_ATTEMPTS):
            try:
                held = from_wire(await self._lists.download(mission_type, expected_items=len(items)))
            except LinkError as error:
                problem = error.detail
                if not self._is_connected():
                    return UploadCheckResult(None, None, UNREACHABLE)
                await self._lists.end_open_transfer(mission_type)
                continue
            seq = first_difference(items, held)
            if seq is None:
                return UploadCheckResult("read_back", mission_id)
            return UploadCheckResult(
                None, None, f"the vehicle holds {len(held)} of {len(items)} items, item {seq} differs"
            )
        return UploadCheckResult(None, None, problem)

    async def _reported(self, mission_type: MissionType, wanted: int) -> bool:
        """Whether MISSION_CURRENT names this list soon. A firmware without ids (0) is not waited for."""
        since_s, answer = time.monotonic(), asyncio.Event()
        found = False

        def look(message: MissionCurrentReport, received_s: float) -> None:
            nonlocal found
            named = _id_of(message, mission_type)
            if received_s >= since_s and named in {wanted, 0}:
                found = named == wanted
                answer.set()

        end = self._inbox.on(MissionCurrentReport, look)
        try:
            async with asyncio.timeout(_REPORT_WITHIN_S):
                await answer.wait()
        except TimeoutError:
            return False
        finally:
            end()
        return found


def _id_of(message: MissionCurrentReport, mission_type: MissionType) -> int:
    return {
        MissionType.MISSION: message.mission_id,
        MissionType.FENCE: message.fence_id,
        MissionType.RALLY: message.rally_points_id,
    }[mission_type]


@dataclass(frozen=True, slots=True)
class UploadRecord:
    """The last verified upload. Times are monotonic."""

    items: tuple[MissionItem, ...]
    mission_id: int | None
    started_s: float
    acked_s: float


class MissionUploader:
    """All mission transfers of one vehicle, one at a time: with two, mavsdk may say SUCCESS and store nothing."""

    def __init__(
        self,
        system: NativeSystem,
        send: Callable[[Outgoing], None],
        inbox: Inbox,
        texts: StatusTexts,
        is_connected: Callable[[], bool],
        watch_items: WatchItems,
        settings: LinkSettings,
    ) -> None:
        self._system = system
        self._inbox = inbox
        self._watch_items = watch_items
        self._texts = texts
        self._settings = settings
        self._lists = ListTransfer(system, send, inbox, settings)
        self._check = UploadCheck(inbox, self._lists, is_connected)
        self._turn = asyncio.Lock()
        self._closed = False
        self.last: UploadRecord | None = None

    async def upload(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        """Upload and verify all three lists; see VehicleLink.upload."""
        if not mission.items:
            raise UploadError("a mission without items cannot be uploaded", mission_type="mission")
        lists = ((MissionType.FENCE, mission.fence), (MissionType.RALLY, mission.rally))
        every = (*lists, (MissionType.MISSION, mission.items))
        async with aclosing(self._upload_lists(*every, attempts=self._settings.upload_attempts)) as steps:
            async for step in steps:
                yield step

    async def replace(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        """Upload and verify the mission alone; see MissionLink.replace_mission."""
        if not mission.items:
            raise UploadError("a mission without items cannot be uploaded", mission_type="mission")
        # once: the vehicle may fly it already, and a second one would take it back to its first item
        async with aclosing(self._upload_lists((MissionType.MISSION, mission.items), attempts=1)) as steps:
            async for step in steps:
                yield step

    async def download(self, mission_type: MissionType, *, expected_items: int) -> tuple[MissionItem, ...]:
        async with self._turn:
            return from_wire(await self._lists.download(mission_type, expected_items=expected_items))

    async def close(self, *, timeout_s: float) -> None:
        """Start nothing any more, and wait until the transfer under way has taken notice of its cancellation."""
        self._closed = True
        try:
            async with asyncio.timeout(timeout_s):
                await self._turn.acquire()
        except TimeoutError:
            return  # somebody holds an upload without going on with it; destroy() ends what is left

    async def _upload_lists(
        self, *lists: tuple[MissionType, tuple[MissionItem, ...]], attempts: int
    ) -> AsyncGenerator[UploadProgress, None]:
        """All in one turn: what is empty is cleared, then one list after the other; the last one is the mission."""
        started_s = time.monotonic()
        async with self._turn:
            self.last = None
            # a stale fence or rally point of an earlier flight must not stay
            await self._clear(*(mission_type for mission_type, items in lists if not items))
            for mission_type, items in lists:
                if not items:
                    continue
                async with aclosing(self._upload_list(mission_type, items, attempts)) as steps:
                    async for step in steps:
                        yield step
            self.last = UploadRecord(items, step.mission_id, started_s, time.monotonic())

    async def _clear(self, *mission_types: MissionType) -> None:
        """All at once: a radio link takes as long for two as for one."""
        results = await asyncio.gather(*map(self._lists.clear, mission_types), return_exceptions=True)
        for mission_type, error in zip(mission_types, results, strict=True):
            name = mission_type.name.lower()
            if isinstance(error, LinkError):
                raise UploadError(f"clearing the old {name} failed: {error.detail}", mission_type=name) from error
            if error is not None:
                raise error

    async def _upload_list(
        self, mission_type: MissionType, items: Sequence[MissionItem], attempts: int
    ) -> AsyncGenerator[UploadProgress, None]:
        total, wire, problem = len(items), to_wire(items), ""
        for attempt in range(1, attempts + 1):
            if self._closed:
                raise LinkError("the link is closed")
            started_s = time.monotonic()
            yield UploadProgress(mission_type, 0, total, attempt)
            async with UploadAttempt(
                self._system, self._inbox, self._watch_items, self._settings, mission_type, wire
            ) as transfer:
                async with aclosing(transfer.steps()) as steps:
                    async for sent in steps:
                        yield UploadProgress(mission_type, sent, total, attempt)
                outcome = await transfer.outcome()
            checked = await self._verify(mission_type, items, outcome, attempt, since_s=started_s)
            if checked.verified_by is not None:
                yield UploadProgress(mission_type, total, total, attempt, checked.verified_by, checked.mission_id)
                return
            problem = checked.problem
            if attempt < attempts:
                await asyncio.sleep(self._settings.upload_backoff_s * attempt)
        name = mission_type.name.lower()
        raise UploadError(
            f"the {name} of {total} items was not stored after {attempts} attempts: {problem}",
            hint="the list on the vehicle is unknown; check the link and retry",
            mission_type=name,
            attempts=attempts,
        )

    async def _verify(
        self,
        mission_type: MissionType,
        items: Sequence[MissionItem],
        outcome: UploadOutcome,
        attempt: int,
        *,
        since_s: float,
    ) -> UploadCheckResult:
        ack = outcome.ack
        if ack is not None and ack.type not in PASSING | {MissionResult.ACCEPTED}:
            await self._raise_refused(mission_type, items, outcome, attempt, since_s=since_s)
        if ack is not None and ack.type == MissionResult.ACCEPTED:
            return await self._check.after_ack(mission_type, items, ack.opaque_id)
        if outcome.result == "SUCCESS":
            return await self._check.after_ack(mission_type, items, 0)
        if ack is None and outcome.result in {"TIMEOUT", "SILENT"}:
            checked = await self._check.without_ack(mission_type, items)
            return (
                checked
                if checked.verified_by
                else UploadCheckResult(None, None, f"{outcome.result}; {checked.problem}")
            )
        self._system.cancel_transfers()
        await self._lists.end_open_transfer(mission_type)
        said = "" if ack is None else f", the vehicle said {result_word(ack.type)}"
        return UploadCheckResult(None, None, f"{outcome.result}{said}")

    async def _raise_refused(
        self,
        mission_type: MissionType,
        items: Sequence[MissionItem],
        outcome: UploadOutcome,
        attempt: int,
        *,
        since_s: float,
    ) -> None:
        assert outcome.ack is not None
        word, seq, name = result_word(outcome.ack.type), outcome.sent_seq, mission_type.name.lower()
        texts = await self._texts.await_reasons(
            since_s, window_s=self._settings.refusal_text_window_s, but=Topic.HEALTH
        )
        place = "" if seq is None else f" item {seq} ({items[seq].command.name})"
        raise UploadRefusedError(
            f"the vehicle refused the {name}{place}: {word}" + "".join(f"; {text}" for text in texts),
            hint="the vehicle keeps the previous list",
            mission_type=name,
            result=word,
            item_seq=seq,
            texts=texts,
            attempts=attempt,
        )
