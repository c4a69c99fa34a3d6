"""The stable codes of all errors, with HTTP status and title. Documented at /api/v1/problems."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """One kind of error. `retry_after_s` is told where trying again later is right."""

    code: str
    status: int
    title: str
    retry_after_s: int | None = None


_KINDS: Final = (
    ProblemKind("request.malformed", 400, "The body is not JSON"),
    ProblemKind("request.invalid", 422, "The body does not fit this request"),
    ProblemKind("request.query_invalid", 400, "A query parameter cannot be used"),
    ProblemKind("request.content_type", 415, "The body must be of a type that is taken here"),
    ProblemKind("request.too_large", 413, "The body is too large"),
    ProblemKind("request.no_room", 503, "Too many large bodies are under way", retry_after_s=5),
    ProblemKind("request.timeout", 408, "The body did not arrive in time"),
    ProblemKind("request.expectation", 417, "The Expect header cannot be met"),
    ProblemKind("path.not_found", 404, "There is nothing at this path"),
    ProblemKind("method.not_allowed", 405, "This path does not take this method"),
    ProblemKind("host.not_allowed", 421, "This service does not answer under this Host name"),
    ProblemKind("origin.not_allowed", 403, "Web pages of this origin may not do this"),
    ProblemKind("auth.required", 401, "Say who you are"),
    ProblemKind("auth.invalid", 401, "This token is not valid"),
    ProblemKind("role.insufficient", 403, "Your role does not allow this"),
    ProblemKind("idempotency.key_invalid", 400, "The Idempotency-Key cannot be used"),
    ProblemKind("idempotency.key_reused", 422, "The Idempotency-Key was used for another request"),
    ProblemKind("connections.full", 503, "Too many connections are open", retry_after_s=5),
    ProblemKind("stream.upgrade_required", 426, "This path is a websocket"),
    ProblemKind("stream.subprotocol", 400, "The websocket subprotocol is not spoken here"),
    ProblemKind("stream.full", 503, "Too many sockets are open", retry_after_s=5),
    ProblemKind("stream.token_full", 429, "This token has too many sockets open", retry_after_s=5),
    ProblemKind("plan.invalid", 422, "The document is not a plan"),
    ProblemKind("plan.rejected", 422, "The plan cannot be flown"),
    ProblemKind("conversion.refused", 422, "The document cannot become a plan"),
    ProblemKind("input.invalid", 422, "The document cannot be used"),
    ProblemKind("not_found", 404, "It does not exist"),
    ProblemKind("conflict", 409, "Not now"),
    ProblemKind("vehicle.busy", 409, "The vehicle is busy with a run"),
    ProblemKind("vehicle.taken", 409, "Somebody else has the vehicle"),
    ProblemKind("vehicle.quarantined", 409, "The vehicle is quarantined"),
    ProblemKind("vehicle.refused", 409, "The vehicle refused"),
    ProblemKind("run.wrong_state", 409, "The run is in another state"),
    ProblemKind("run.drop_in_progress", 409, "A drop is in progress"),
    ProblemKind("run.pause_first", 409, "The vehicle has to hold first"),
    ProblemKind("run.changing", 409, "The mission is being changed"),
    ProblemKind("run.not_over", 409, "The run is not over"),
    ProblemKind("run.nothing_left", 409, "Nothing is left to fly"),
    ProblemKind("run.continued", 409, "The run was continued already"),
    ProblemKind("run.rally_refused", 409, "A return goes to no rally point now"),
    ProblemKind("job.wrong_state", 409, "The job is in another state"),
    ProblemKind("jobs.full", 409, "So many jobs wait that no other is taken"),
    ProblemKind("drop.consent_not_asked", 409, "The drop asks for no consent now"),
    ProblemKind("drop.consent_too_late", 409, "The time to consent is over"),
    ProblemKind("drop.consent_answered", 409, "The other answer came first"),
    ProblemKind("setpoint.refused", 422, "The setpoint is not sent"),
    ProblemKind("tasks.refused", 422, "The task is refused"),
    ProblemKind("tasks.full", 409, "The task queue is full"),
    ProblemKind("tasks.under_way", 409, "The task is flown already"),
    ProblemKind("offboard.lease_held", 409, "Another client has the lease"),
    ProblemKind("offboard.lease_lost", 409, "The lease is not yours, or has ended"),
    ProblemKind("offboard.not_ready", 409, "Offboard control cannot begin now"),
    ProblemKind("offboard.audit_failed", 409, "The vehicle's parameters make offboard control unsafe"),
    ProblemKind("command.expired", 504, "The moment for this command is over"),
    ProblemKind("vehicle.link", 502, "The link to the vehicle failed"),
    ProblemKind("mission.upload_failed", 502, "The mission could not be uploaded"),
    ProblemKind("vehicle.timeout", 504, "The vehicle did not answer"),
    ProblemKind("simulator.not_running", 404, "No simulated vehicles are known here"),
    ProblemKind("simulator.refused", 409, "The simulator refused"),
    ProblemKind("simulator.no_answer", 504, "The simulator did not answer"),
    ProblemKind("attachments.full", 507, "There is no room for more attachments"),
    ProblemKind("attachment.altered", 410, "The file that was attached is not there any more"),
    ProblemKind("storage.failed", 503, "The journal cannot be written", retry_after_s=5),
    ProblemKind("internal", 500, "A defect of the service"),
)

PROBLEMS: Final[dict[str, ProblemKind]] = {kind.code: kind for kind in _KINDS}
