"""`waydrop fly`: have a plan flown by a vehicle and follow it until every drop has an outcome."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Coroutine
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from app.cli.plan_report import WindOption, read_plan, wind_given
from app.cli.run_view import STRICT, JsonView, RunView, TerminalView, assess
from app.cli.service_client import (
    EventStream,
    ServerOption,
    ServiceClient,
    StreamCut,
    StreamItem,
    TokenOption,
    parsed,
    service_client,
)
from app.cli.terminal import ExitStatus, err, out
from app.domain.drop.record import Certainty
from app.domain.errors import WaydropError
from app.domain.events import Event, EventKind
from app.domain.events.run import RunChanged
from app.domain.plan import Plan
from app.domain.prediction import WindGiven
from app.domain.reasons import describe
from app.domain.run.run import Run, RunState

_OF_THE_VEHICLE = frozenset(
    {
        EventKind.VEHICLE_STATUS_TEXT,
        EventKind.VEHICLE_LINK_LOST,
        EventKind.VEHICLE_LINK_RESTORED,
        EventKind.VEHICLE_REBOOTED,
    }
)


class StartFailedError(WaydropError, code="run.start_failed"):
    """The vehicle stands on the ground with the mission uploaded; the run can be started again or aborted."""


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
        self.run = parsed(Run, await self._client.post("/runs", document))
        return self.run

    async def follow(self) -> Run:
        """Show the run until it ends, and return it.

        Raises:
            StartFailedError: the start failed on the ground.
            ServerUnreachableError: the service was unreachable for longer than the stream's patience.
        """
        run = self.run
        if run is None:
            raise ValueError("start comes before follow")
        async for item in self._items:
            if isinstance(item, StreamCut):
                self._view.note(f"connection to Waydrop lost ({item.reason}): the flight continues, reconnecting")
            if not isinstance(item, Event) or not _concerns(item, run):
                continue
            self._view.event(item)
            if item.run_id == run.id and isinstance(item.data, RunChanged):
                before, run = run, item.data.root
                self.run = run
                _refuse_failed_start(before, run)
                if run.is_over:
                    break
        return parsed(Run, await self._client.get(f"/runs/{run.id}"))


def _concerns(event: Event, run: Run) -> bool:
    return event.run_id == run.id or (event.vehicle_id == run.vehicle_id and event.kind in _OF_THE_VEHICLE)


def _refuse_failed_start(before: Run, run: Run) -> None:
    if before.state is RunState.STARTING and run.state is RunState.UPLOADED:
        raise StartFailedError(
            f"{run.vehicle_id} did not start: {describe(run.reason)}",
            hint=f"correct the cause, then `waydrop runs start {run.id}`; or abort: `waydrop runs abort {run.id}`",
        )


def fly(
    file: Annotated[Path, typer.Argument(help="The plan, a JSON file; - is standard input.")],
    vehicle: Annotated[str, typer.Option("--vehicle", help="The vehicle; `waydrop vehicles` lists them.")],
    server: ServerOption,
    token: TokenOption = None,
    wind: WindOption = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="Require an acknowledgement: short for --certainty acknowledged.")
    ] = False,
    certainty: Annotated[
        Certainty, typer.Option(help="Minimum certainty of a release for exit status 0.")
    ] = Certainty.INFERRED,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document per line instead of text.")] = False,
) -> None:
    """Fly a plan and follow it. Exit status 0 only if every drop was released and the run completed.

    Ctrl-C and SIGTERM stop following: the flight goes on.
    """
    given = wind_given(wind)
    plan = read_plan(file)
    least = STRICT if strict and certainty is Certainty.INFERRED else certainty
    view: JsonView | TerminalView = JsonView() if as_json else TerminalView(out())
    with view:
        following = fly_and_follow(plan, vehicle, server, token, least, view, given)
        raise typer.Exit(asyncio.run(_until_sigterm(following)))


async def _until_sigterm(following: Coroutine[Any, Any, ExitStatus]) -> ExitStatus:
    """SIGTERM cancels it, as asyncio.run does at Ctrl-C."""
    task = asyncio.create_task(following)
    with suppress(RuntimeError):  # another thread than the main one gets no signals
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    await asyncio.wait({task})
    return ExitStatus.TERMINATED if task.cancelled() else task.result()


async def fly_and_follow(
    plan: Plan,
    vehicle_id: str,
    server: str,
    token: str | None,
    least: Certainty,
    view: RunView,
    wind: WindGiven | None = None,
) -> ExitStatus:
    """Post the plan, start the run, report to `view`, and assess the end. Cancelling leaves the flight alone."""
    async with service_client(server, token) as client:
        stored = await client.post("/plans", plan.model_dump(mode="json"))
        follower = RunFollower(client, EventStream(client), view)
        try:
            run = await follower.start(str(stored["id"]), vehicle_id, wind)
            view.note(f"run {run.id}: plan {plan.name} ({stored['id']}) with vehicle {vehicle_id}")
            run = await follower.follow()
        except StartFailedError:
            raise  # it stands on the ground
        except (asyncio.CancelledError, WaydropError) as error:
            if follower.run is not None or isinstance(error, asyncio.CancelledError):
                _print_left_run(follower.run)
            raise
        assessment = assess(run, least=least)
        view.ended(run, assessment)
        return ExitStatus.OK if assessment.achieved else ExitStatus.NOT_ACHIEVED


def _print_left_run(run: Run | None) -> None:
    if run is None:
        err().print(
            "\n[yellow]interrupted while the run was being created:[/] check with `waydrop runs` whether it exists"
        )
        return
    name, state = escape(run.id), run.state.value.replace("_", " ")
    at = f" (item {escape(run.item_id)})" if run.item_id else ""
    err().print(
        f"\n[yellow]stopped following; the flight continues.[/] Last known: {state}{at}. "
        f"Show it with `waydrop runs show {name}`, return it with `waydrop runs return {name}`"
    )
