"""The inputs of flights on SQLite; implements FlightLog. Parts are packed, and old runs make room for new ones."""

from __future__ import annotations

import asyncio
import zlib

import sqlalchemy as sa
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.errors import StorageError
from app.domain.flight.log_port import MOST_BYTES, MOST_RUNS
from app.storage.database import Database
from app.storage.schema import FLIGHT_INPUTS


class SqliteFlightLog:
    """FlightLog on one SQLite file."""

    def __init__(self, database: Database) -> None:
        self._database = database

    async def append(self, run_id: str, text: str) -> None:
        """See FlightLog."""
        part = await asyncio.to_thread(zlib.compress, text.encode())

        async def store(connection: AsyncConnection) -> None:
            of_run = FLIGHT_INPUTS.c.run_id == run_id
            size = sa.select(sa.func.coalesce(sa.func.sum(sa.func.length(FLIGHT_INPUTS.c.part)), 0)).where(of_run)
            kept = (await connection.execute(size)).scalar_one()
            if kept + len(part) > MOST_BYTES:
                return
            await connection.execute(FLIGHT_INPUTS.insert(), {"run_id": run_id, "part": part})
            if kept == 0:
                await connection.execute(FLIGHT_INPUTS.delete().where(FLIGHT_INPUTS.c.run_id.not_in(_newest())))

        await self._database.write(store)

    async def read(self, run_id: str) -> str:
        """See FlightLog."""
        of_run = sa.select(FLIGHT_INPUTS.c.part).where(FLIGHT_INPUTS.c.run_id == run_id)
        rows = await self._database.read(of_run.order_by(FLIGHT_INPUTS.c.position))
        try:
            return "".join(zlib.decompress(row["part"]).decode() for row in rows)
        except (zlib.error, ValueError) as error:
            raise StorageError(f"the inputs of run {run_id} cannot be read: {error}") from error


def _newest() -> sa.Select[tuple[str]]:
    newest = sa.func.max(FLIGHT_INPUTS.c.position).desc()
    return sa.select(FLIGHT_INPUTS.c.run_id).group_by(FLIGHT_INPUTS.c.run_id).order_by(newest).limit(MOST_RUNS)
