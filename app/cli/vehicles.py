"""`waydrop vehicles`: list the vehicles and their state."""

from __future__ import annotations

import asyncio
from typing import Annotated, Any, Final

import typer
from rich.table import Table

from app.cli.service_client import ServerOption, ServiceClient, TokenOption, with_client
from app.cli.terminal import ServerRefusedError, err, out, write_json
from app.domain.run.run import RunState

STARTS_WITHIN_S: Final = 60.0
AGAIN_AFTER_S: Final = 0.2


def vehicles(
    server: ServerOption,
    token: TokenOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the response of the service as JSON.")] = False,
) -> None:
    """List the vehicles."""
    answer = with_client(server, token, lambda client: client.get("/vehicles"))
    if as_json:
        write_json(answer)
    elif not answer["vehicles"]:
        err().print("no vehicle has connected yet")
    else:
        out().print(vehicles_table(answer["vehicles"]))


def vehicles_table(rows: list[dict[str, Any]]) -> Table:
    table = Table()
    for name in ("vehicle", "type", "firmware", "link", "mode", "state", "battery", "run"):
        table.add_column(name)
    for row in rows:
        state = row["state"]
        battery = state.get("battery_percent")
        table.add_row(
            row["id"],
            (row.get("vehicle_type") or "?").replace("_", " "),
            row.get("firmware") or "?",
            "quarantined" if row.get("quarantined") else "up" if state["connected"] else "lost",
            state.get("mode") or "?",
            ("armed, " if state.get("armed") else "") + str(state.get("landed", "")).replace("_", " "),
            "" if battery is None else f"{battery:.0f}%",
            row.get("run_id") or "",
        )
    return table


VehicleArgument = Annotated[
    str, typer.Argument(metavar="VEHICLE", help="ID of the vehicle, as shown by `waydrop vehicles`.")
]


def hold(vehicle: VehicleArgument, server: ServerOption, token: TokenOption = None) -> None:
    """Hold position: pauses the run of the vehicle and ends offboard control."""
    out().print(vehicles_table([with_client(server, token, lambda client: hold_vehicle(client, vehicle))]))


async def hold_vehicle(client: ServiceClient, vehicle_id: str) -> Any:
    """Return the vehicle, in Hold mode. One that is being started is held as soon as it flies.

    Raises ServerRefusedError.
    """
    until_s = asyncio.get_running_loop().time() + STARTS_WITHIN_S
    while True:
        vehicle = await client.get(f"/vehicles/{vehicle_id}")
        run_id = vehicle.get("run_id")
        try:
            await client.post(f"/vehicles/{vehicle_id}/hold" if run_id is None else f"/runs/{run_id}/pause")
        except ServerRefusedError as error:
            starts = error.code == "run.wrong_state" and error.extra.get("state") == RunState.STARTING
            if not starts or asyncio.get_running_loop().time() > until_s:
                raise
            await asyncio.sleep(AGAIN_AFTER_S)
        else:
            return await client.get(f"/vehicles/{vehicle_id}")


def take_over(server: ServerOption, token: TokenOption = None) -> None:
    """Let a gateway take over the site of another one that is switched off. Requires the role admin."""
    answer = with_client(server, token, lambda client: client.post("/site/take-over", {}))
    left = ", ".join(answer["left_run_ids"])
    err().print(
        f"the gateway has the site, but could not take over {left} yet: it goes on trying, see its log"
        if left
        else "the gateway has the site, and goes on with its runs"
    )
