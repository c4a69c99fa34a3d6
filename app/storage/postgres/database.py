"""PostgreSQL: a pool of connections, and connections of their own for what lasts."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager, suppress
from typing import Any, Final, TypeAlias

import asyncpg
import sqlalchemy as sa
from sqlalchemy.dialects.postgresql.asyncpg import PGDialect_asyncpg
from sqlalchemy.exc import StatementError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from sqlalchemy.ext.asyncio import AsyncConnection, AsyncEngine, create_async_engine

from app.domain.errors import InvalidInputError, StorageError
from app.storage.database import T, Work

AsyncWork: TypeAlias = Callable[[AsyncConnection], Awaitable[T]]

CONNECTIONS: Final = 8
CONNECT_TIMEOUT_S: Final = 5.0
CHECKOUT_TIMEOUT_S: Final = 10.0
"""Until a connection of the pool is free and has answered, or is made anew."""
COMMAND_TIMEOUT_S: Final = 30.0
CLOSE_TIMEOUT_S: Final = 1.0
"""Of a connection that is closed: a server that has not taken leave by then has lost it."""
_KEEPALIVES: Final = {"tcp_keepalives_idle": "2", "tcp_keepalives_interval": "1", "tcp_keepalives_count": "3"}
"""A machine that is gone loses its locks after 5 s."""


_DRIVER_ERRORS: Final = (
    *(asyncpg.PostgresError, asyncpg.InterfaceError, OSError, TimeoutError, PoolTimeoutError),
    asyncpg.InternalClientError,  # of a connection that PostgreSQL has just ended
)


@contextmanager
def postgres_errors() -> Iterator[None]:
    """Turn every error of PostgreSQL into a StorageError."""
    try:
        yield
    except StatementError as error:
        raise StorageError(f"PostgreSQL: {error.orig}", hint=_HINT) from error
    except _DRIVER_ERRORS as error:
        raise StorageError(f"PostgreSQL: {str(error) or type(error).__name__}", hint=_HINT) from error


class CommitLostError(StorageError):
    """The connection was lost during the commit: it may have stored what it was to store."""

    code = "gateway.no_reply"


@contextmanager
def _commit_errors() -> Iterator[None]:
    try:
        with postgres_errors():
            yield
    except StorageError as error:
        raise CommitLostError(
            f"it is not known whether PostgreSQL has stored this: {error.detail}",
            hint="look at what was created before you repeat it",
        ) from error


_HINT: Final = "see that PostgreSQL runs and can be reached; gateways go on without it"


class PostgresDatabase:
    """TableAccess on PostgreSQL."""

    def __init__(self, url: str) -> None:
        self._pooled: Final = _engine(url, pool_size=CONNECTIONS, max_overflow=0, pool_pre_ping=True)
        self._single: Final = _engine(url, poolclass=sa.NullPool)

    async def write(self, work: Work[T]) -> T:
        return await self.transact(lambda connection: connection.run_sync(work))

    async def transact(self, work: AsyncWork[T]) -> T:
        """As `write`, for work that awaits and uses the driver, too. Raises CommitLostError: it may be stored."""
        async with self._of_the_pool() as connection:
            await connection.begin()
            result = await work(connection)
            with _commit_errors():
                await connection.commit()
            return result

    async def read(self, query: sa.Select[Any]) -> Sequence[sa.RowMapping]:
        async with self._of_the_pool() as connection:
            rows: Sequence[sa.RowMapping] = (await connection.execute(query)).mappings().all()
            return rows

    @asynccontextmanager
    async def _of_the_pool(self) -> AsyncIterator[AsyncConnection]:
        with postgres_errors():
            async with AsyncExitStack() as checkin:
                async with asyncio.timeout(CHECKOUT_TIMEOUT_S):  # one that does not answer leaves the pool
                    connection = await checkin.enter_async_context(self._pooled.connect())
                yield connection

    @asynccontextmanager
    async def session(self) -> AsyncIterator[AsyncConnection]:
        """A connection of its own: locks and LISTEN last as long as it. Raises StorageError."""
        with postgres_errors():
            async with self._single.connect() as connection:
                try:
                    yield connection
                finally:  # without a rollback, which waits for an answer when the connection is lost in silence
                    await connection.invalidate()

    async def close(self) -> None:
        """Close all connections. Idempotent."""
        await self._pooled.dispose()
        await self._single.dispose()


class _Connection(asyncpg.Connection):  # type: ignore[misc]  # asyncpg has no types
    """Closes in time, also when it is lost in silence."""

    async def close(self, *, timeout: float | None = None) -> None:  # noqa: ASYNC109 - asyncpg has it
        with suppress(TimeoutError):  # asyncpg has aborted it then
            await super().close(timeout=min(CLOSE_TIMEOUT_S, timeout or CLOSE_TIMEOUT_S))


async def driver_of(connection: AsyncConnection) -> asyncpg.Connection[Any]:
    """The driver's own connection, for COPY and LISTEN."""
    driver = (await connection.get_raw_connection()).driver_connection
    if not isinstance(driver, asyncpg.Connection):
        raise TypeError("asyncpg is the driver")
    return driver


class DriverStatement:
    """A statement with named parameters for asyncpg itself, for what is written all the time."""

    def __init__(self, statement: sa.TextClause) -> None:
        compiled = statement.compile(dialect=PGDialect_asyncpg())  # type: ignore[no-untyped-call]
        self._names: Final = tuple(compiled.positiontup or ())
        self._text: Final = str(compiled)

    async def execute_many(self, driver: asyncpg.Connection[Any], rows: Sequence[Mapping[str, object]]) -> None:
        """Execute it for each row, in one round trip."""
        if rows:
            await driver.executemany(self._text, [[row[name] for name in self._names] for row in rows])


def unnested(first: int, types: Mapping[str, str]) -> str:
    """SQL: the table `new` of arrays, which are the parameters from `$first` on: one for each column. `n` numbers its
    rows.
    """
    arrays = ", ".join(f"${number}::{of}[]" for number, of in enumerate(types.values(), first))
    return f"unnest({arrays}) WITH ORDINALITY AS new ({', '.join(types)}, n)"


def arrays_of(rows: Sequence[Mapping[str, object]], types: Mapping[str, str]) -> Sequence[Sequence[object]]:
    """The parameters of `unnested`."""
    return [[row[name] for row in rows] for name in types]


def _engine(url: str, **options: Any) -> AsyncEngine:
    try:
        parsed = sa.make_url(url).set(drivername="postgresql+asyncpg")
    except sa.exc.ArgumentError as error:
        raise InvalidInputError("the address of PostgreSQL is postgresql://USER:PASSWORD@HOST:PORT/DATABASE") from error
    return create_async_engine(
        parsed,
        connect_args={
            "timeout": CONNECT_TIMEOUT_S,
            "command_timeout": COMMAND_TIMEOUT_S,
            "connection_class": _Connection,
            "server_settings": {"application_name": "waydrop", **_KEEPALIVES},
        },
        **options,
    )
