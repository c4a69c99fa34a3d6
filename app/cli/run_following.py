"""Starts a run and follows it to its end over the event stream."""

from __future__ import annotations

from collections.abc import AsyncIterator

from app.cli.event_stream import EventStream, StreamCut, StreamItem
from app.cli.run_view import RunView
from app.cli.service_client import ServiceClient
from app.domain.errors import WaydropError
from app.domain.events import Event, EventKind
from app.domain.events.run import RunChanged
from app.domain.prediction import WindGiven
from app.domain.reason import in_words
from app.domain.run import Run, RunState

_OF_THE_VEHICLE = frozenset(
    {
        EventKind.VEHICLE_STATUS_TEXT,
        EventKind.VEHICLE_LINK_LOST,
        EventKind.VEHICLE_LINK_RESTORED,
        EventKind.VEHICLE_REBOOTED,
    }
)


class StartFailedError(WaydropError):
    """The vehicle stands on the ground with the mission uploaded; the run can be started again or aborted."""

    code = "run.start_failed"


class RunFollower:
    """One run, from its creation to its end. `run` is the newest state; None before `start`."""

    def __init__(self, client: ServiceClient, stream: EventStream, view: RunView) -> None:
        self._client = client
        self._items: AsyncIterator[StreamItem] = stream.items()
        self._view = view
        self.run: Run | None = None

    async def start(self, plan_id: str, vehicle_id: str, wind: WindGiven | None = None) -> Run:
        """Create the run and have it started. The stream is opened first, so that no event of it is missed."""
        await anext(self._items)
        document: dict[str, object] = {"plan": plan_id, "vehicle": vehicle_id, "start": True}
        if wind is not None:
            document["wind"] = wind.model_dump(mode="json", exclude_none=True)
        self.run = Run.model_validate(await self._client.post("/runs", document))
        return self.run

    async def follow(self) -> Run:
        """Show the run until it is over, and give it as it ended.

        Raises:
            StartFailedError: the start failed on the ground.
            ServerUnreachableError: the service stayed away for longer than the stream's patience.
        """
        run = self.run
        if run is None:
            raise ValueError("start comes before follow")
        async for item in self._items:
            if isinstance(item, StreamCut):
                self._view.note(f"connection to Waydrop lost ({item.reason}): the flight goes on, connecting again")
            if not isinstance(item, Event) or not _concerns(item, run):
                continue
            self._view.event(item)
            if item.run_id == run.id and isinstance(item.data, RunChanged):
                before, run = run, item.data.root
                self.run = run
                _refuse_failed_start(before, run)
                if run.is_over:
                    break
        return Run.model_validate(await self._client.get(f"/runs/{run.id}"))


def _concerns(event: Event, run: Run) -> bool:
    return event.run_id == run.id or (event.vehicle_id == run.vehicle_id and event.kind in _OF_THE_VEHICLE)


def _refuse_failed_start(before: Run, run: Run) -> None:
    if before.state is RunState.STARTING and run.state is RunState.UPLOADED:
        raise StartFailedError(
            f"{run.vehicle_id} did not start: {in_words(run.reason)}",
            hint=f"mend it and `waydrop runs start {run.id}`, or free the vehicle: `waydrop runs abort {run.id}`",
        )
