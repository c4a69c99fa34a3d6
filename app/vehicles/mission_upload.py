"""Uploading a mission: fence, rally points, mission last; each list tried again within a budget and verified."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import aclosing
from dataclasses import dataclass

from app.domain.errors import LinkError, UploadError
from app.domain.mission import Mission, MissionItem, MissionType
from app.domain.mission_port import UploadProgress
from app.vehicles.encoders import Outgoing
from app.vehicles.event_reasons import Topic
from app.vehicles.inbox import Inbox
from app.vehicles.list_transfer import ListTransfer
from app.vehicles.mavsdk_system import NativeSystem
from app.vehicles.mission_result import PASSING, MissionResult, result_word
from app.vehicles.mission_wire import from_wire, to_wire
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts
from app.vehicles.upload_attempt import UploadAttempt, UploadOutcome
from app.vehicles.upload_check import UploadCheck, Verdict


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
        settings: LinkSettings,
    ) -> None:
        self._system = system
        self._inbox = inbox
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
        """See VehicleLink.download."""
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
        """One after the other in one turn; the last one is the mission."""
        started_s = time.monotonic()
        async with self._turn:
            self.last = None
            for mission_type, items in lists:
                if not items:  # a stale fence or rally point of an earlier flight must not stay
                    await self._clear(mission_type)
                    continue
                async with aclosing(self._upload_list(mission_type, items, attempts)) as steps:
                    async for step in steps:
                        yield step
            self.last = UploadRecord(items, step.mission_id, started_s, time.monotonic())

    async def _clear(self, mission_type: MissionType) -> None:
        name = mission_type.name.lower()
        try:
            await self._lists.clear(mission_type)
        except LinkError as error:
            raise UploadError(f"clearing the old {name} failed: {error.detail}", mission_type=name) from error

    async def _upload_list(
        self, mission_type: MissionType, items: Sequence[MissionItem], attempts: int
    ) -> AsyncGenerator[UploadProgress, None]:
        total, wire, problem = len(items), to_wire(items), ""
        for attempt in range(1, attempts + 1):
            if self._closed:
                raise LinkError("the link is closed")
            started_s = time.monotonic()
            yield UploadProgress(mission_type, 0, total, attempt)
            async with UploadAttempt(self._system, self._inbox, self._settings, mission_type, wire) as transfer:
                async with aclosing(transfer.steps()) as steps:
                    async for sent in steps:
                        yield UploadProgress(mission_type, sent, total, attempt)
                outcome = await transfer.outcome()
            verdict = await self._judge(mission_type, items, outcome, attempt, since_s=started_s)
            if verdict.verified_by is not None:
                yield UploadProgress(mission_type, total, total, attempt, verdict.verified_by, verdict.mission_id)
                return
            problem = verdict.problem
            if attempt < attempts:
                await asyncio.sleep(self._settings.upload_backoff_s * attempt)
        name = mission_type.name.lower()
        raise UploadError(
            f"the {name} of {total} items was not stored after {attempts} attempts: {problem}",
            hint="read the list back before trusting what the vehicle holds; check the link and try again",
            mission_type=name,
            attempts=attempts,
        )

    async def _judge(
        self,
        mission_type: MissionType,
        items: Sequence[MissionItem],
        outcome: UploadOutcome,
        attempt: int,
        *,
        since_s: float,
    ) -> Verdict:
        ack = outcome.ack
        if ack is not None and ack.type not in PASSING | {MissionResult.ACCEPTED}:
            await self._raise_refused(mission_type, items, outcome, attempt, since_s=since_s)
        if ack is not None and ack.type == MissionResult.ACCEPTED:
            return await self._check.after_ack(mission_type, items, ack.opaque_id)
        if outcome.result == "SUCCESS":
            return await self._check.after_ack(mission_type, items, 0)
        if ack is None and outcome.result in {"TIMEOUT", "SILENT"}:
            verdict = await self._check.without_ack(mission_type, items)
            return verdict if verdict.verified_by else Verdict(None, None, f"{outcome.result}; {verdict.problem}")
        self._system.cancel_transfers()
        await self._lists.end_open_transfer(mission_type)
        said = "" if ack is None else f", the vehicle said {result_word(ack.type)}"
        return Verdict(None, None, f"{outcome.result}{said}")

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
        word, seq, name = result_word(outcome.ack.type), outcome.requested_seq, mission_type.name.lower()
        texts = await self._texts.await_reasons(
            since_s, window_s=self._settings.refusal_text_window_s, but=Topic.HEALTH
        )
        place = "" if seq is None else f" item {seq} ({items[seq].command.name})"
        raise UploadError(
            f"the vehicle refused the {name}{place}: {word}" + "".join(f"; {text}" for text in texts),
            hint="the vehicle keeps what it held before",
            mission_type=name,
            result=word,
            item_seq=seq,
            texts=texts,
            attempts=attempt,
        )
