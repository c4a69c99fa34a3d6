/** The nouns of the API under short names, from the types made of its OpenAPI document (`npm run types`). */

import type { components } from "./schema";

type Schemas = components["schemas"];

export type VehicleType = Schemas["VehicleType"];
export type VehicleState = Schemas["StateView"];
export type Vehicle = Schemas["VehicleView"];
export type RunState = Schemas["RunState"];
/** What an operator may ask of a run under way. */
export type RunAction = "start" | "pause" | "resume" | "return" | "divert" | "land" | "abort";
export type Run = Schemas["Run"];
export type FlightMode = Schemas["FlightMode"];
export type LinkSecurity = Schemas["LinkSecurity"];
export type LandedState = Schemas["LandedState"];
export type DropRecord = Schemas["DropRecord"];
export type DropPhase = Schemas["DropPhase"];
export type DropOutcome = Schemas["DropOutcome"];
export type OutputEvidence = Schemas["OutputEvidence"];
export type MavResult = NonNullable<Schemas["RunAck"]["result"]>;
export type MavSeverity = Schemas["MavSeverity"];
export type Certainty = Schemas["Certainty"];
export type ConsentState = Schemas["ConsentState"];
export type Attachment = Schemas["Attachment"];
export type ConsentRecord = Schemas["ConsentRecord"];
export type Reason = Schemas["Reason"];
export type ReasonCode = Schemas["ReasonCode"];
export type Finding = Schemas["Finding"];
export type Timeline = Schemas["Timeline"];
export type Comparison = Schemas["Comparison"];
export type ItemComparison = Schemas["ItemComparison"];
export type DropComparison = Schemas["DropComparison"];
export type ConversionFinding = Schemas["ConversionFinding"];
export type TargetFormat = Schemas["TargetFormat"];
/** Documents of other software that the service reads. */
export type ForeignFormat = Exclude<Schemas["SourceFormat"], "plan">;
/** A wind as weather reports and the API say it. */
export type Wind = Readonly<Record<keyof Pick<Schemas["WindGiven"], "from_deg" | "speed_m_s">, number>>;
/** A JSON Schema as the service publishes it. */
export type JsonSchema = Readonly<Record<string, unknown>>;
export type PlanHead = Schemas["PlanHead"];
export type PlansPage = Schemas["PlansView"];
export type StoredPlan = Schemas["PlanView"];
export type Principal = Schemas["PrincipalView"];
export type OffboardExit = Schemas["LeaveRequest"]["to"];
export type Role = Schemas["Role"];
export type SimulatorView = Schemas["SimulatorView"];
export type SimulatedVehicle = Schemas["SimulatedVehicleView"];
export type SimulatorSpeed = Schemas["SpeedView"];
export type FaultKind = Schemas["FaultKind"];

/** The page's own: it stands for events that the service no longer has. */
type MissingEvents = Omit<Schemas["ServiceStoppedEvent"], "kind" | "data"> & {
  kind: "page.missing";
  data: { first: number; last: number };
};

/** An event of the stream. `kind` determines the type of `data`. */
export type StreamEvent = Schemas["Event"] | MissingEvents;
export type EventKind = StreamEvent["kind"];
export type EventOf<K extends EventKind> = Extract<StreamEvent, { kind: K }>;

// Frames of /api/v1/stream, in the order in which the service sends them: hello, snapshot, then events and telemetry.
export type HelloFrame = Schemas["HelloFrame"];
export type SnapshotFrame = Schemas["SnapshotFrame"];
export type EventFrame = Schemas["EventFrame"];
export type TelemetryFrame = Schemas["TelemetryFrame"];
export type StreamFrame = HelloFrame | SnapshotFrame | EventFrame | TelemetryFrame;

export type Target = Schemas["TargetView"];
export type Job = Schemas["Job"];
/** What is not given has its default. */
export type JobRequest = Pick<Schemas["JobRequest"], "plan"> &
  Partial<Omit<Schemas["JobRequest"], "plan" | "wind">> & { readonly wind?: Wind | null };
/** Another priority or place of a waiting job. */
export type JobUpdate = Partial<Schemas["JobUpdate"]>;
/** The vehicle that a job would get now, and what speaks for and against each. */
export type JobAssignment = Schemas["AssignmentView"];
export type JobState = Schemas["JobState"];
export type JobCandidate = Schemas["Candidate"];
export type JobQueue = Schemas["VehicleQueue"];
export type JobsPage = Schemas["JobsView"];

/** A plan document as typed, possibly incomplete: plan/document.ts reads what is there. */
export type PlanDocument = Readonly<Record<string, unknown>>;

export type Offboard = Schemas["OffboardView"];
export type OffboardState = Schemas["OffboardState"];
export type OffboardDetail = Schemas["OffboardDetail"];
export type OffboardLimits = Schemas["OffboardLimits"];
export type Capability = Schemas["CapabilityView"];
export type EntryCheck = Schemas["EntryCheckView"];
export type AuditEntry = Schemas["AuditView"];
export type Clamp = Schemas["ClampView"];
export type SentSetpoint = Schemas["SentView"];
export type Rate = Schemas["RateView"];
export type SentCommand = Schemas["SentCommandView"];
export type TaskControl = Schemas["TaskControlView"];
export type ControlMethodName = NonNullable<TaskControl["control_method"]>;
export type VelocityBody = Schemas["VelocityBody"];
export type PositionGlobal = Schemas["PositionGlobal"];

export type TaskQueue = Schemas["TasksView"];
export type QueuedTask = Schemas["QueuedTaskView"];
export type TaskReport = Schemas["TaskReport"];
export type TaskOrigin = Schemas["OriginView"];
export type TaskState = TaskReport["state"];
export type Task = QueuedTask["task"];
export type TaskTerms = Schemas["TaskTerms"];
export type TaskPoint = Schemas["Goto"]["point"];
export type InsertMode = Schemas["TaskRequest"]["insert"];
export type WhenEmpty = TaskQueue["when_empty"];
export type TaskChange = Schemas["TasksChanged"]["change"];

// Frames of the offboard websocket (docs/reference/offboard.md). The socket numbers those that it sends.
type Unnumbered<F extends { id: unknown }> = Omit<F, "id">;
/** What is asked of the task queue (docs/reference/tasks.md). */
export type QueueRequest =
  | Unnumbered<Schemas["TaskFrame"]>
  | Unnumbered<Schemas["QueueFrame"]>
  | Unnumbered<Schemas["MoveFrame"]>
  | Unnumbered<Schemas["ChangeFrame"]>
  | Unnumbered<Schemas["TargetFrame"]>
  | Unnumbered<Schemas["RemoveFrame"]>;
export type ClientFrame =
  | QueueRequest
  | Unnumbered<Schemas["AcquireLeaseFrame"]>
  | Unnumbered<Schemas["HandOverLeaseFrame"]>
  | Unnumbered<Schemas["RenewLeaseFrame"]>
  | Omit<Schemas["EnterFrame"], "id" | "control_method">
  | Unnumbered<Schemas["SetpointFrame"]>
  | Unnumbered<Schemas["LeaveFrame"]>
  | Unnumbered<Schemas["ReleaseLeaseFrame"]>;
export type StateFrame = Schemas["StateFrame"];
export type TasksFrame = Schemas["TasksFrame"];
export type ServerAnswer =
  | Schemas["LeaseGrantedFrame"]
  | Schemas["SetpointAckFrame"]
  | Schemas["QueuedFrame"]
  | Schemas["DoneFrame"]
  | Schemas["ErrorFrame"];
export type QueueAction = Schemas["QueueFrame"]["action"];
