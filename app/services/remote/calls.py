"""Calls from API nodes to gateways: signed by the node, carried out once, never repeated by themselves."""

from __future__ import annotations

import hashlib
import hmac
import secrets
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Mapping
from functools import cache
from typing import Any, Final, TypeVar

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError, validate_call
from pydantic_core import to_jsonable_python

from app.domain import errors
from app.domain.cluster import errors as cluster_errors
from app.domain.cluster.errors import NoReplyError
from app.domain.cluster.ports import Bus, GatewaySite
from app.domain.errors import InvalidInputError, NotFoundError, WaydropError
from app.services.clock import Clock

T = TypeVar("T")

CALL_TIMEOUT_S: Final = 20.0
BEGUN_S: Final = 15.0
"""A call that is older is refused: who asked is soon told that its outcome is unknown, and may ask again by hand. A
network that was cut delivers such calls. The rest of CALL_TIMEOUT_S is for clocks that differ."""
AHEAD_S: Final = 30.0
"""A call whose time is so far ahead of the clock here is refused."""
REMEMBERED: Final = 20_000


class CallRefusedError(WaydropError):
    """The call was not signed with this cluster's key, is late, or is repeated. Nothing was done."""

    code = "cluster.call_refused"


class RemoteCall(BaseModel):
    """One call. `time` is in Unix seconds; `site` and `id` keep it from being answered elsewhere or twice.

    Of two gateways with one site, only the one at `address` carries it out; without an address, the one that has the
    site.
    """

    model_config = ConfigDict(frozen=True)

    id: str
    site: str
    address: str = ""
    method: str
    arguments: dict[str, Any]
    time: float


class RemoteProblem(BaseModel):
    """An expected error, as it travels."""

    code: str
    detail: str
    hint: str = ""
    extra: dict[str, Any] = {}
    may_be_done: bool = False


class RemoteReply(BaseModel):
    """The answer to the call `id`. `seq` is the gateway's newest event then: what was done is told by it or before."""

    id: str
    gateway: str
    seq: int
    value: Any = None
    error: RemoteProblem | None = None


class _Signed(BaseModel):
    body: str
    signature: str


def signed(message: BaseModel, key: bytes) -> bytes:
    """The message with its HMAC-SHA256."""
    body = message.model_dump_json()
    return _Signed(body=body, signature=_signature(body, key)).model_dump_json().encode()


def verified(message: bytes, key: bytes) -> str:
    """The JSON of a message that was signed with the key. Raises CallRefusedError."""
    try:
        found = _Signed.model_validate_json(message)
    except ValidationError as error:
        raise CallRefusedError("not a signed message") from error
    if not hmac.compare_digest(found.signature, _signature(found.body, key)):
        raise CallRefusedError("signed with another key", hint="all parts need the same WAYDROP_CLUSTER_KEY")
    return found.body


def _signature(body: str, key: bytes) -> str:
    return hmac.new(key, body.encode(), hashlib.sha256).hexdigest()


Reached = Callable[[str, int], Awaitable[None]]
"""Waits until an event of a gateway can be read where the call came from."""


class Caller:
    """Calls other parts of the cluster."""

    def __init__(self, bus: Bus, key: bytes, reached: Reached, clock: Clock) -> None:
        self._bus = bus
        self._key = key
        self._reached = reached
        self._clock = clock
        self._adapters: dict[object, TypeAdapter[Any]] = {}

    async def call(
        self,
        subject: str,
        site: str,
        method: str,
        returns: type[T],
        address: str = "",
        timeout_s: float = CALL_TIMEOUT_S,
        /,
        **arguments: object,
    ) -> T:
        """What the method returned, after all API nodes can read what it did.

        Raises:
            GatewayUnreachableError, BusDownError: nothing was done.
            NoReplyError: it may have been done.
            WaydropError: what the method raised.
        """
        call = RemoteCall(
            id=secrets.token_hex(8),
            site=site,
            address=address,
            method=method,
            arguments=to_jsonable_python(arguments),
            time=self._clock.now(),
        )
        answer = await self._bus.request(subject, signed(call, self._key), timeout_s=timeout_s)
        reply = self._reply(answer)
        if reply.id not in (call.id, ""):
            raise NoReplyError("the answer belongs to another call")
        if reply.error is not None:
            raise error_of(reply.error)
        await self._reached(reply.gateway, reply.seq)
        if returns not in self._adapters:
            self._adapters[returns] = TypeAdapter(returns)
        try:
            value: T = self._adapters[returns].validate_python(reply.value)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            raise NoReplyError(
                f"{method} was carried out, and its answer cannot be read: {first['msg']}",
                hint="give all parts of the cluster one version",
            ) from error
        return value

    def _reply(self, answer: bytes) -> RemoteReply:
        try:
            return RemoteReply.model_validate_json(verified(answer, self._key))
        except (CallRefusedError, ValidationError) as error:
            raise NoReplyError("the answer is not signed by a gateway of this cluster") from error


class RemoteProblemError(WaydropError):
    """An expected error of a gateway whose class is not known here."""

    def __init__(self, problem: RemoteProblem) -> None:
        super().__init__(problem.detail, hint=problem.hint, **_extra(problem))
        self.code = problem.code


def error_of(problem: RemoteProblem) -> WaydropError:
    """The error of the class that has this code."""
    cls = _classes().get(problem.code)
    error = RemoteProblemError(problem) if cls is None else cls(problem.detail, hint=problem.hint, **_extra(problem))
    if problem.may_be_done:
        error.mark_may_be_done()
    return error


def _extra(problem: RemoteProblem) -> dict[str, Any]:
    return {name: value for name, value in problem.extra.items() if name not in ("detail", "hint")}


@cache
def _classes() -> dict[str, type[WaydropError]]:
    found = (*vars(errors).values(), *vars(cluster_errors).values(), CallRefusedError)
    classes = [cls for cls in found if isinstance(cls, type) and issubclass(cls, WaydropError)]
    # a subclass may have the code of its base, which stands before it: the code tells of no more than the base
    return {cls.code: cls for cls in reversed(classes)}


CallFunctions = Mapping[str, Callable[..., Awaitable[object]]]
"""What a part of the cluster does for others, by the names of the calls."""


async def _always() -> None:
    """Nobody else carries these calls out."""


class CallServer:
    """Answers calls by functions of their names. Arguments are validated by the functions' annotations.

    A node that has heard no report of the site yet calls without an address: for whom `has_site` is true.
    `require_right` raises a WaydropError if another process carries calls out by now: then nothing is done.
    """

    def __init__(
        self,
        part: GatewaySite,
        functions: CallFunctions,
        key: bytes,
        seq: Callable[[], int],
        clock: Clock,
        has_site: Callable[[], bool] = lambda: True,
        require_right: Callable[[], Awaitable[None]] = _always,
    ) -> None:
        self._part = part
        self._require_right = require_right
        self._has_site = has_site
        self._key = key
        self._seq = seq
        self._clock = clock
        self._seen: OrderedDict[str, float] = OrderedDict()
        self._functions = {name: validate_call(function) for name, function in functions.items()}

    async def answer(self, message: bytes) -> bytes:
        """See Answering. A call for another gateway of this site is not answered."""
        call_id = ""
        try:
            call = self._read(message)
            if call.address != self._part.address and (call.address or not self._has_site()):
                return b""
            call_id = call.id
            await self._require_right()
            value = to_jsonable_python(await self._carry_out(call))
        except WaydropError as error:
            extra = to_jsonable_python(dict(error.extra), fallback=str)
            problem = RemoteProblem(
                code=error.code, detail=error.detail, hint=error.hint, extra=extra, may_be_done=error.may_be_done
            )
            return self._reply(call_id, error=problem)
        return self._reply(call_id, value=value)

    def _reply(self, call_id: str, *, value: object = None, error: RemoteProblem | None = None) -> bytes:
        reply = RemoteReply(id=call_id, gateway=self._part.gateway, seq=self._seq(), value=value, error=error)
        return signed(reply, self._key)

    def _read(self, message: bytes) -> RemoteCall:
        try:
            call = RemoteCall.model_validate_json(verified(message, self._key))
        except ValidationError as error:
            raise CallRefusedError("not a call of this version", hint="upgrade the gateways") from error
        age_s = self._clock.now() - call.time
        if call.site != self._part.site or not -AHEAD_S <= age_s <= BEGUN_S or call.id in self._seen:
            raise CallRefusedError(
                f"a call for {call.site} that is {age_s:.0f} s old, or repeated; nothing was done",
                hint="try again; if it stays so, set all clocks by NTP",
            )
        self._seen[call.id] = call.time
        while len(self._seen) > REMEMBERED or self._clock.now() - next(iter(self._seen.values())) > 2 * AHEAD_S:
            self._seen.popitem(last=False)
        return call

    async def _carry_out(self, call: RemoteCall) -> object:
        function = self._functions.get(call.method)
        if function is None:
            raise NotFoundError(f"this gateway knows no call {call.method!r}", hint="upgrade the gateways")
        try:
            return await function(**call.arguments)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            raise InvalidInputError(f"{call.method}: {first['msg']}", hint="upgrade the gateways") from error
