"""Expected errors. Each has a stable code, which api/problems.py maps to an HTTP response."""

from __future__ import annotations

from collections.abc import Mapping


class WaydropError(Exception):
    """Base of all expected errors. `code` is stable, `detail` describes the problem, `hint` says how to fix it."""

    code = "service.internal_error"
    may_be_done = False
    """Whether what was requested may have been done all the same, so that a repetition must not do it again."""

    def __init_subclass__(cls, code: str | None = None) -> None:
        super().__init_subclass__()
        cls.code = code or cls.code

    def __init__(self, detail: str, *, hint: str = "", **extra: object) -> None:
        super().__init__(detail)
        self.detail = detail
        self.hint = hint
        self.extra: Mapping[str, object] = extra

    def mark_may_be_done(self) -> None:
        """See `may_be_done`."""
        self.may_be_done = True


class NotFoundError(WaydropError, code="resource.not_found"):
    """The resource does not exist."""


class ConflictError(WaydropError, code="state.conflict"):
    """The request is valid but conflicts with the current state: vehicle busy, vehicle quarantined, wrong run state."""


class VehicleBusyError(ConflictError, code="vehicle.busy"):
    """The vehicle is flying another run."""


class VehicleTakenError(ConflictError, code="vehicle.taken"):
    """Another client or a pilot controls the vehicle: it was armed or switched to another mode, not by Waydrop.

    `extra["mode"]` is the current mode, `extra["armed"]` whether it is armed.
    """


class VehicleInFailsafeError(ConflictError, code="vehicle.in_failsafe"):
    """A failsafe holds the vehicle, perhaps before it acts. PX4 gives it up for any mode that is commanded then."""


class VehicleQuarantinedError(ConflictError, code="vehicle.quarantined"):
    """Two vehicles use the same system ID. A command could reach the wrong one, so none is sent."""


class WrongStateError(ConflictError, code="run.wrong_state"):
    """The run or vehicle is in a state that does not allow the operation."""


class RunNotFollowedError(WrongStateError, code="run.not_followed"):
    """The service does not follow the run yet: its vehicle is not there, its mission cannot be read, or another gateway
    had the run.
    """


class DropInProgressError(ConflictError, code="run.drop_in_progress"):
    """The vehicle is at a drop, or a release has not been answered yet. The mission cannot be changed until then."""


class HoldRequiredError(ConflictError, code="run.hold_required"):
    """The change is safe only while the vehicle holds."""


class ChangeUnderWayError(ConflictError, code="run.changing"):
    """A mission change is in progress, or its outcome is unknown."""


class RunNotOverError(ConflictError, code="run.not_over"):
    """Only a finished run can be continued."""


class NoRemainingItemsError(ConflictError, code="run.no_remaining_items"):
    """The run has no remaining items."""


class RunContinuedError(ConflictError, code="run.continued"):
    """The run was already continued, by the run `extra["continued_by"]`."""


class DivertRefusedError(ConflictError, code="run.divert_refused"):
    """A return would not go to a rally point, or may not.

    `extra["refusal"]`: divert.no_rally_points, divert.other_rally_points, divert.return_type, divert.approach_forced,
    divert.other_is_nearer, divert.too_close or divert.flew_on.
    """


class JobWrongStateError(ConflictError, code="job.wrong_state"):
    """The job is in a state that does not allow the operation."""


class JobNotTakenError(ConflictError, code="job.not_taken"):
    """A gateway does not take a job of its cluster: it has stored nothing, and makes no run."""


class JobQueueFullError(ConflictError, code="job.queue_full"):
    """The queue of jobs is full."""


class ConsentNotAskedError(ConflictError, code="drop.consent_not_asked"):
    """No consent request of this drop is pending."""


class ConsentTooLateError(ConflictError, code="drop.consent_too_late"):
    """The consent request has expired, which counts as a refusal."""


class ConsentAnsweredError(ConflictError, code="drop.consent_answered"):
    """The opposite answer was given first, and stands."""


class WebhookSecretLostError(ConflictError, code="webhook.secret_lost"):
    """The webhook's secret cannot be decrypted, so that nothing can be signed with it."""


class InvalidInputError(WaydropError, code="input.invalid"):
    """The document is invalid. `findings` are JSON-serializable, with pointer, code and message."""


class TooManyAttemptsError(WaydropError, code="auth.too_many_attempts"):
    """Too many invalid tokens came from one address; `extra["retry_after_s"]` says how long it has to wait."""


class PlanRejectedError(WaydropError, code="plan.rejected"):
    """The plan is well-formed but violates rules. `extra["findings"]` lists the violations."""


class PlanWorkTimeoutError(WaydropError, code="plan.work_timeout"):
    """A plan or a file took too long to work on. It is not tried again."""


class LinkError(WaydropError, code="vehicle.link"):
    """The vehicle did not answer, or the link failed. The vehicle's state is unknown and must be read again."""


class LinkTimeoutError(LinkError, code="vehicle.timeout"):
    """No answer within the deadline, after all retries."""


class VehicleRefusedError(LinkError, code="vehicle.refused"):
    """The vehicle rejected the command. `extra` has its MAV_RESULT or MAV_MISSION_RESULT."""


class CommandExpiredError(LinkError, code="command.expired"):
    """The command expired before it could be sent."""


class UploadError(LinkError, code="mission.upload_failed"):
    """The mission upload failed or could not be verified. The mission is never started."""


class UploadRefusedError(UploadError):
    """The vehicle refused the list (MISSION_ACK) and keeps the previous one."""


class StorageError(WaydropError, code="storage.failed"):
    """The journal is not writable, so nothing may be reported as done."""


class RecordRefusedError(StorageError):
    """The journal refuses what one call wants to store. What was to be stored with it may be stored without it."""


class EventsPrunedError(WaydropError, code="events.pruned"):
    """Events after the requested one were deleted by age; `first_seq` is the oldest that is kept."""

    def __init__(self, detail: str, *, hint: str = "", first_seq: int = 1) -> None:
        super().__init__(detail, hint=hint, first_seq=first_seq)
        self.first_seq = first_seq


class AttachmentExpiredError(WaydropError, code="attachment.expired"):
    """The file of an attachment was deleted by age."""


class AttachmentQuotaError(WaydropError, code="attachment.quota_exceeded"):
    """The storage quota for attachments is exhausted."""


class AttachmentAlteredError(WaydropError, code="attachment.altered"):
    """The stored file of an attachment is missing or does not match the journal."""


class SimulatorNotRunningError(NotFoundError, code="simulator.not_running"):
    """The service does not know any simulated vehicles."""


class SimulatorRefusedError(ConflictError, code="simulator.refused"):
    """The simulator rejected the fault. The detail has its reason."""


class SimulatorSilentError(WaydropError, code="simulator.no_answer"):
    """The simulator did not answer, or answered malformed data."""


class RefusalError(InvalidInputError):
    """A command is not sent to the vehicle. `refusal` is the stable code of the reason, `code` by default."""

    def __init__(self, detail: str, *, refusal: str = "", hint: str = "", **extra: object) -> None:
        self.refusal = refusal or self.code
        super().__init__(detail, hint=hint, refusal=self.refusal, **extra)


class SetpointRefusedError(RefusalError, code="setpoint.refused"):
    """The setpoint is rejected: the vehicle does not follow this form, or it exceeds a limit.

    `refusal` is a code such as `setpoint.not_followed` or `limit.fence`.
    """


class LeaseHeldError(ConflictError, code="offboard.lease_held"):
    """Another client holds the vehicle's offboard lease."""


class LeaseLostError(ConflictError, code="offboard.lease_lost"):
    """The client does not hold the lease, or no longer."""


class OffboardNotReadyError(ConflictError, code="offboard.not_ready"):
    """The state of the vehicle or its run does not allow offboard control."""


class AuditFailedError(OffboardNotReadyError, code="offboard.audit_failed"):
    """The vehicle's parameters would make the loss of setpoints dangerous. `extra["audit"]` lists them."""


class TaskRefusedError(RefusalError, code="task.refused"):
    """The task is rejected: the vehicle cannot fly it, or it exceeds a limit.

    `refusal` is a code such as `task.no_length` or `limit.fence`.
    """


class TaskQueueFullError(ConflictError, code="task.queue_full"):
    """The vehicle's task queue is full."""


class TaskActiveError(ConflictError, code="task.active"):
    """The task has started, so it cannot be changed."""
