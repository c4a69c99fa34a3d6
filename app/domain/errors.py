"""Errors that a user can cause or mend. Each has a stable code; api/ maps codes to HTTP answers in one place."""

from __future__ import annotations

from collections.abc import Mapping


class WaydropError(Exception):
    """Base of all expected errors: `code` is stable, `detail` says what is wrong, `hint` how to mend it."""

    code = "service.internal_error"

    def __init__(self, detail: str, *, hint: str = "", **extra: object) -> None:
        super().__init__(detail)
        self.detail = detail
        self.hint = hint
        self.extra: Mapping[str, object] = extra


class NotFoundError(WaydropError):
    """The named thing does not exist."""

    code = "resource.not_found"


class ConflictError(WaydropError):
    """The request is right but not now: the vehicle is busy, quarantined, or the run is in another state."""

    code = "state.conflict"


class VehicleBusyError(ConflictError):
    """The vehicle already flies a run."""

    code = "vehicle.busy"


class VehicleTakenError(ConflictError):
    """Somebody else has the vehicle: it is armed, or was put into another mode, and not by Waydrop.

    `extra["mode"]` is its mode, `extra["armed"]` whether it is armed.
    """

    code = "vehicle.taken"


class VehicleQuarantinedError(ConflictError):
    """Two vehicles use one system id: commands could reach the wrong one, so none are sent."""

    code = "vehicle.quarantined"


class WrongStateError(ConflictError):
    """The run or vehicle is in a state in which this cannot be done."""

    code = "run.wrong_state"


class DropInProgressError(ConflictError):
    """The vehicle is at a drop, or a release is not answered yet: the flight's plan cannot be changed until it is."""

    code = "run.drop_in_progress"


class HoldRequiredError(ConflictError):
    """The change is safe only while the vehicle holds."""

    code = "run.hold_required"


class ChangeUnderWayError(ConflictError):
    """A change of the run's mission is under way, or it is not known whether it arrived."""

    code = "run.changing"


class RunNotOverError(ConflictError):
    """Only a run that is over is continued by another."""

    code = "run.not_over"


class NoRemainingItemsError(ConflictError):
    """The run has nothing left to fly."""

    code = "run.no_remaining_items"


class RunContinuedError(ConflictError):
    """The run was continued already; `extra["continued_by"]` is by which run."""

    code = "run.continued"


class DivertRefusedError(ConflictError):
    """A return now goes to no rally point, or that is not sure.

    `extra["refusal"]`: divert.no_rally_points, divert.other_rally_points, divert.return_type, divert.approach_forced,
    divert.other_is_nearer, divert.too_close or divert.flew_on.
    """

    code = "run.divert_refused"


class JobWrongStateError(ConflictError):
    """The job is in a state in which this cannot be done."""

    code = "job.wrong_state"


class JobQueueFullError(ConflictError):
    """So many jobs wait that no other is taken."""

    code = "job.queue_full"


class ConsentNotAskedError(ConflictError):
    """The drop asks for no consent now: not yet, not any more, or never."""

    code = "drop.consent_not_asked"


class ConsentTooLateError(ConflictError):
    """The time to answer was over: that counts as a refusal."""

    code = "drop.consent_too_late"


class ConsentAnsweredError(ConflictError):
    """The other answer came first, and counts."""

    code = "drop.consent_answered"


class WebhookSecretLostError(ConflictError):
    """The webhook's secret cannot be decrypted, so that nothing can be signed with it."""

    code = "webhook.secret_lost"


class InvalidInputError(WaydropError):
    """The document cannot be used. `findings` are JSON-able with pointer, code, message."""

    code = "input.invalid"


class PlanRejectedError(WaydropError):
    """The plan is well-formed but rules found errors; `extra["findings"]` lists them."""

    code = "plan.rejected"


class LinkError(WaydropError):
    """The vehicle did not answer, or the link refused. The vehicle's state must be read again, not assumed."""

    code = "vehicle.link"


class LinkTimeoutError(LinkError):
    """No answer within the deadline, after all retries."""

    code = "vehicle.timeout"


class VehicleRefusedError(LinkError):
    """The vehicle answered with a refusal: a MAV_RESULT or MAV_MISSION_RESULT, kept in `extra`."""

    code = "vehicle.refused"


class CommandExpiredError(LinkError):
    """The command was not sent: its time was over before it could leave."""

    code = "command.expired"


class UploadError(LinkError):
    """A mission upload that did not end verified. Nothing of it is ever started."""

    code = "mission.upload_failed"


class LinkKeyError(ConflictError):
    """The signing keys of the vehicle links cannot be used, or not so."""

    code = "link_key.unusable"


class StorageError(WaydropError):
    """The journal cannot be written: nothing may be reported as done."""

    code = "storage.failed"


class AttachmentQuotaError(WaydropError):
    """The files that were attached take all the room that they may have."""

    code = "attachment.quota_exceeded"


class AttachmentAlteredError(WaydropError):
    """An attachment's file is not the one that the journal says, or is gone."""

    code = "attachment.altered"


class SimulatorNotRunningError(NotFoundError):
    """No simulated vehicles are known to this service."""

    code = "simulator.not_running"


class SimulatorRefusedError(ConflictError):
    """The simulator does not take the fault; the detail is its reason."""

    code = "simulator.refused"


class SimulatorSilentError(WaydropError):
    """The simulator did not answer, or not in its own protocol."""

    code = "simulator.no_answer"


class RefusalError(InvalidInputError):
    """A vehicle is not told what it should do. `refusal` is the stable code of the reason; without one `code`."""

    def __init__(self, detail: str, *, refusal: str = "", hint: str = "", **extra: object) -> None:
        self.refusal = refusal or self.code
        super().__init__(detail, hint=hint, refusal=self.refusal, **extra)


class SetpointRefusedError(RefusalError):
    """The setpoint is not sent: this vehicle does not follow it, or it leads beyond a limit.

    `refusal` is such as `setpoint.not_followed` or `limit.fence`.
    """

    code = "setpoint.refused"


class LeaseHeldError(ConflictError):
    """Another client has the vehicle's offboard lease."""

    code = "offboard.lease_held"


class LeaseLostError(ConflictError):
    """The lease is not, or no longer, the client's."""

    code = "offboard.lease_lost"


class OffboardNotReadyError(ConflictError):
    """The vehicle or its run is in a state in which offboard control may not begin."""

    code = "offboard.not_ready"


class AuditFailedError(OffboardNotReadyError):
    """The vehicle's own parameters would make a lost stream dangerous; `extra["audit"]` lists them."""

    code = "offboard.audit_failed"


class TaskRefusedError(RefusalError):
    """The task is neither queued nor changed: this vehicle cannot fly it, or it leads beyond a limit.

    `refusal` is such as `task.no_length` or `limit.fence`.
    """

    code = "task.refused"


class TaskQueueFullError(ConflictError):
    """The vehicle's task queue has no place left."""

    code = "task.queue_full"


class TaskActiveError(ConflictError):
    """The task is flown already: what was said of it stays."""

    code = "task.active"
