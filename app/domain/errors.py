"""Expected errors. Each has a stable code, which api/problems.py maps to an HTTP response."""

from __future__ import annotations

from collections.abc import Mapping


class WaydropError(Exception):
    """Base of all expected errors. `code` is stable, `detail` describes the problem, `hint` says how to fix it."""

    code = "service.internal_error"

    def __init__(self, detail: str, *, hint: str = "", **extra: object) -> None:
        super().__init__(detail)
        self.detail = detail
        self.hint = hint
        self.extra: Mapping[str, object] = extra


class NotFoundError(WaydropError):
    """The resource does not exist."""

    code = "resource.not_found"


class ConflictError(WaydropError):
    """The request is valid but conflicts with the current state: vehicle busy, vehicle quarantined, wrong run state."""

    code = "state.conflict"


class VehicleBusyError(ConflictError):
    """The vehicle is flying another run."""

    code = "vehicle.busy"


class VehicleTakenError(ConflictError):
    """Another client or a pilot controls the vehicle: it was armed or switched to another mode, not by Waydrop.

    `extra["mode"]` is the current mode, `extra["armed"]` whether it is armed.
    """

    code = "vehicle.taken"


class VehicleQuarantinedError(ConflictError):
    """Two vehicles use the same system ID. A command could reach the wrong one, so none is sent."""

    code = "vehicle.quarantined"


class WrongStateError(ConflictError):
    """The run or vehicle is in a state that does not allow the operation."""

    code = "run.wrong_state"


class DropInProgressError(ConflictError):
    """The vehicle is at a drop, or a release has not been answered yet. The mission cannot be changed until then."""

    code = "run.drop_in_progress"


class HoldRequiredError(ConflictError):
    """The change is safe only while the vehicle holds."""

    code = "run.hold_required"


class ChangeUnderWayError(ConflictError):
    """A mission change is in progress, or its outcome is unknown."""

    code = "run.changing"


class RunNotOverError(ConflictError):
    """Only a finished run can be continued."""

    code = "run.not_over"


class NoRemainingItemsError(ConflictError):
    """The run has no remaining items."""

    code = "run.no_remaining_items"


class RunContinuedError(ConflictError):
    """The run was already continued, by the run `extra["continued_by"]`."""

    code = "run.continued"


class DivertRefusedError(ConflictError):
    """A return would not go to a rally point, or may not.

    `extra["refusal"]`: divert.no_rally_points, divert.other_rally_points, divert.return_type, divert.approach_forced,
    divert.other_is_nearer, divert.too_close or divert.flew_on.
    """

    code = "run.divert_refused"


class JobWrongStateError(ConflictError):
    """The job is in a state that does not allow the operation."""

    code = "job.wrong_state"


class JobQueueFullError(ConflictError):
    """The queue of jobs is full."""

    code = "job.queue_full"


class ConsentNotAskedError(ConflictError):
    """No consent request of this drop is pending."""

    code = "drop.consent_not_asked"


class ConsentTooLateError(ConflictError):
    """The consent request has expired, which counts as a refusal."""

    code = "drop.consent_too_late"


class ConsentAnsweredError(ConflictError):
    """The opposite answer was given first, and stands."""

    code = "drop.consent_answered"


class WebhookSecretLostError(ConflictError):
    """The webhook's secret cannot be decrypted, so that nothing can be signed with it."""

    code = "webhook.secret_lost"


class InvalidInputError(WaydropError):
    """The document is invalid. `findings` are JSON-serializable, with pointer, code and message."""

    code = "input.invalid"


class TooManyAttemptsError(WaydropError):
    """Too many invalid tokens came from one address; `extra["retry_after_s"]` says how long it has to wait."""

    code = "auth.too_many_attempts"


class PlanRejectedError(WaydropError):
    """The plan is well-formed but violates rules. `extra["findings"]` lists the violations."""

    code = "plan.rejected"


class LinkError(WaydropError):
    """The vehicle did not answer, or the link failed. The vehicle's state is unknown and must be read again."""

    code = "vehicle.link"


class LinkTimeoutError(LinkError):
    """No answer within the deadline, after all retries."""

    code = "vehicle.timeout"


class VehicleRefusedError(LinkError):
    """The vehicle rejected the command. `extra` has its MAV_RESULT or MAV_MISSION_RESULT."""

    code = "vehicle.refused"


class CommandExpiredError(LinkError):
    """The command expired before it could be sent."""

    code = "command.expired"


class UploadError(LinkError):
    """The mission upload failed or could not be verified. The mission is never started."""

    code = "mission.upload_failed"


class StorageError(WaydropError):
    """The journal is not writable, so nothing may be reported as done."""

    code = "storage.failed"


class AttachmentQuotaError(WaydropError):
    """The storage quota for attachments is exhausted."""

    code = "attachment.quota_exceeded"


class AttachmentAlteredError(WaydropError):
    """The stored file of an attachment is missing or does not match the journal."""

    code = "attachment.altered"


class SimulatorNotRunningError(NotFoundError):
    """The service does not know any simulated vehicles."""

    code = "simulator.not_running"


class SimulatorRefusedError(ConflictError):
    """The simulator rejected the fault. The detail has its reason."""

    code = "simulator.refused"


class SimulatorSilentError(WaydropError):
    """The simulator did not answer, or answered malformed data."""

    code = "simulator.no_answer"


class RefusalError(InvalidInputError):
    """A command is not sent to the vehicle. `refusal` is the stable code of the reason, `code` by default."""

    def __init__(self, detail: str, *, refusal: str = "", hint: str = "", **extra: object) -> None:
        self.refusal = refusal or self.code
        super().__init__(detail, hint=hint, refusal=self.refusal, **extra)


class SetpointRefusedError(RefusalError):
    """The setpoint is rejected: the vehicle does not follow this form, or it exceeds a limit.

    `refusal` is a code such as `setpoint.not_followed` or `limit.fence`.
    """

    code = "setpoint.refused"


class LeaseHeldError(ConflictError):
    """Another client holds the vehicle's offboard lease."""

    code = "offboard.lease_held"


class LeaseLostError(ConflictError):
    """The client does not hold the lease, or no longer."""

    code = "offboard.lease_lost"


class OffboardNotReadyError(ConflictError):
    """The state of the vehicle or its run does not allow offboard control."""

    code = "offboard.not_ready"


class AuditFailedError(OffboardNotReadyError):
    """The vehicle's parameters would make the loss of setpoints dangerous. `extra["audit"]` lists them."""

    code = "offboard.audit_failed"


class TaskRefusedError(RefusalError):
    """The task is rejected: the vehicle cannot fly it, or it exceeds a limit.

    `refusal` is a code such as `task.no_length` or `limit.fence`.
    """

    code = "task.refused"


class TaskQueueFullError(ConflictError):
    """The vehicle's task queue is full."""

    code = "task.queue_full"


class TaskActiveError(ConflictError):
    """The task has started, so it cannot be changed."""

    code = "task.active"
