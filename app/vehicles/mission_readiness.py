"""When a mission may be started: MISSION_CURRENT names it and PX4's feasibility checks have passed.

An accepted upload is not a valid mission. PX4 checks afterwards and shows an infeasible one as mission_state 1, but
for up to 0.9 s it may still show the state of before.
"""

from __future__ import annotations

import asyncio
import time
from typing import Final

from app.domain.errors import LinkTimeoutError, VehicleRefusedError
from app.domain.mission import MissionType
from app.domain.vehicle.state import FlightMode, MissionState, VehicleState
from app.vehicles.decoders import MissionCurrentReport
from app.vehicles.event_reasons import Topic
from app.vehicles.inbox import Inbox
from app.vehicles.measurements import Measurements, mission_state
from app.vehicles.mission_upload import MissionUploader, UploadRecord
from app.vehicles.mission_wire import first_difference
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts

_FLOWN_BEFORE: Final = frozenset({MissionState.ACTIVE, MissionState.PAUSED, MissionState.COMPLETE})
_COMPLETE: Final = _FLOWN_BEFORE | {MissionState.NOT_STARTED}


class OtherMission:
    """A complete mission with another id than `mission_id`, and since when MISSION_CURRENT has reported it."""

    def __init__(self, mission_id: int | None) -> None:
        self._ours = {mission_id, 0}
        self._seen: tuple[int, float] | None = None

    def steady_s(self, report: MissionCurrentReport, at_s: float) -> float:
        """For how long this same one has been reported without a break; 0 if it is none."""
        if report.mission_id in self._ours or mission_state(report) not in _COMPLETE:
            self._seen = None
        elif self._seen is None or self._seen[0] != report.mission_id:
            self._seen = report.mission_id, at_s
        return 0.0 if self._seen is None else at_s - self._seen[1]


class MissionReadiness:
    """Waits until the vehicle would accept a start."""

    def __init__(
        self,
        measurements: Measurements,
        inbox: Inbox,
        texts: StatusTexts,
        uploader: MissionUploader,
        settings: LinkSettings,
    ) -> None:
        self._measurements = measurements
        self._inbox = inbox
        self._texts = texts
        self._uploader = uploader
        self._settings = settings

    async def wait(self, *, mission_id: int | None, rerun: bool, timeout_s: float) -> None:
        upload = None if rerun else self._uploader.last
        since_s = upload.acked_s if upload else time.monotonic()
        settles_s = since_s + self._settings.mission_ready_after_ack_s
        # a start within some 3 ms of the ack is rejected
        await asyncio.sleep(max(0.0, settles_s - time.monotonic()))
        news, other = asyncio.Event(), OtherMission(mission_id)
        end = self._inbox.on(MissionCurrentReport, lambda _message, _at_s: news.set())
        try:
            async with asyncio.timeout(timeout_s):
                while not await self._is_ready(mission_id, upload, since_s, rerun=rerun):
                    self._refuse_other(mission_id, other, since_s)
                    news.clear()
                    await news.wait()
        except TimeoutError as error:
            raise LinkTimeoutError(self._waited_for(mission_id, timeout_s)) from error
        finally:
            end()

    async def _is_ready(
        self, mission_id: int | None, upload: UploadRecord | None, since_s: float, *, rerun: bool
    ) -> bool:
        report, at_s = self._measurements.mission, self._measurements.mission_s
        if report is None or at_s is None or (at_s < since_s and not rerun):
            return False
        if mission_id is not None and report.mission_id not in {mission_id, 0}:
            return False
        state, settled = mission_state(report), at_s - since_s >= self._settings.mission_state_stale_s
        if state is MissionState.UNKNOWN:
            await self._compare(upload)
            return True
        if state is MissionState.NO_MISSION:
            if settled:
                self._refuse(report, upload, since_s)
            return False
        flown = rerun or settled or self._is_executed(at_s - since_s)
        return state is MissionState.NOT_STARTED or (state in _FLOWN_BEFORE and flown)

    def _is_executed(self, newer_s: float) -> bool:
        """In flight a new mission is executed at once: its state stays active, and an infeasible one's for a moment."""
        state = self._state()
        newer_s *= max(1.0, state.clock.least_rate or 1.0)  # a simulation's moment is shorter
        return bool(state.armed) and newer_s >= self._settings.executed_after_s

    def _state(self) -> VehicleState:
        return self._measurements.state(time.monotonic(), connected=True)

    async def _compare(self, upload: UploadRecord | None) -> None:
        """A firmware that reports no state: all that can be known is that it holds the mission."""
        if upload is None:
            return
        held = await self._uploader.download(MissionType.MISSION, expected_items=len(upload.items))
        seq = first_difference(upload.items, held)
        if seq is not None:
            raise VehicleRefusedError(f"the vehicle holds another mission: item {seq} differs", item_seq=seq)

    def _refuse_other(self, mission_id: int | None, other: OtherMission, since_s: float) -> None:
        """MISSION_CURRENT is late after an upload, but not for that long: another client has replaced the mission."""
        report, at_s = self._measurements.mission, self._measurements.mission_s
        if mission_id is None or report is None or at_s is None or at_s < since_s:
            return
        if other.steady_s(report, at_s) < self._settings.other_mission_s:
            return
        then = "repeat the change" if self._state().armed else "create the run again"
        raise VehicleRefusedError(
            f"another mission is on board: the vehicle reports mission {report.mission_id} instead of {mission_id}",
            hint=f"another client uploaded it; {then}",
        )

    def _refuse(self, report: MissionCurrentReport, upload: UploadRecord | None, since_s: float) -> None:
        texts = self._texts.reasons_since(upload.started_s if upload else since_s, but=Topic.HEALTH)
        checks = () if texts else self._texts.failing_checks(FlightMode.MISSION)
        why = "; ".join(texts or checks) or "the vehicle reported no reason"
        hint = "correct the plan; the vehicle will not start this mission"
        if checks:
            hint = "resolve what its health checks report, then create the run again"
        raise VehicleRefusedError(
            f"the vehicle reported the mission as infeasible: {why}",
            hint=hint,
            texts=texts or checks,
            mission_state=mission_state(report).value,
        )

    def _waited_for(self, mission_id: int | None, timeout_s: float) -> str:
        report = self._measurements.mission
        if report is None:
            return f"no MISSION_CURRENT within {timeout_s:g} s"
        if mission_id is not None and report.mission_id != mission_id:
            return f"the vehicle reports mission {report.mission_id} instead of {mission_id} after {timeout_s:g} s"
        return f"the mission is not ready after {timeout_s:g} s: mission_state is {mission_state(report).value}"
