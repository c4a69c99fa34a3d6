/** Vehicles, runs, drops and events for tests, with the few fields that a test cares for. */

import type {
  ConsentRecord,
  DropRecord,
  EventFrame,
  EventKind,
  Job,
  Reason,
  ReasonCode,
  Run,
  StreamEvent,
  Vehicle,
  VehicleState,
} from "../api/types";

export function sampleState(fields: Partial<VehicleState> = {}): VehicleState {
  return {
    connected: true,
    link_security: "pinned",
    mode: "hold",
    armed: false,
    landed: "on_ground",
    in_failsafe: false,
    is_terminated: false,
    latitude_deg: 47.4,
    longitude_deg: 8.55,
    absolute_altitude_m: 488,
    relative_altitude_m: 0,
    velocity_north_m_s: 0,
    velocity_east_m_s: 0,
    velocity_down_m_s: 0,
    heading_deg: 0,
    position_age_s: 0.1,
    heartbeat_age_s: 0.3,
    battery_percent: 90,
    home: null,
    mission_seq: null,
    mission_total: null,
    mission_state: "no_mission",
    mission_id: null,
    vtol_state: null,
    gnss_fix: "3d",
    gnss_satellites: 10,
    gnss_hdop: 0.7,
    gripper_output_us: null,
    offboard: null,
    ...fields,
  };
}

export function sampleVehicle(fields: Partial<Vehicle> = {}): Vehicle {
  return {
    id: "v1",
    system_id: 1,
    vehicle_type: "multicopter",
    firmware: "1.18.0",
    uid: null,
    connection: "udpin://127.0.0.1:14540",
    quarantined: null,
    run_id: null,
    performance: null,
    state: sampleState(),
    ...fields,
  };
}

export function sampleJob(fields: Partial<Job> = {}): Job {
  return {
    id: "job-1",
    plan_id: "p-1",
    plan_hash: "sha256:0",
    plan_name: "Clinic run",
    vehicle_type: "multicopter",
    order_id: null,
    selector: { vehicle: "any", allowed_vehicles: [], min_battery_percent: 0 },
    wind: null,
    warning: "",
    not_before: null,
    deadline: null,
    auto_start: false,
    priority: 0,
    rank: 0,
    state: "queued",
    reason: null,
    requested_by: "desk",
    vehicle_id: null,
    run_id: null,
    candidates: [],
    start_requested_at: null,
    end_requested: "",
    fence: 0,
    claim: null,
    created_at: 100,
    updated_at: 100,
    ended_at: null,
    ...fields,
  };
}

export function because(code: ReasonCode, params: Reason["params"] = {}, cause: Reason | null = null): Reason {
  return { code, params, cause };
}

export function sampleDrop(fields: Partial<DropRecord> = {}): DropRecord {
  return {
    plan_item_id: "drop",
    supervised: true,
    alternate_to: null,
    phase: "waiting",
    outcome: "pending",
    certainty: "none",
    reason: null,
    consent: null,
    attempts: 0,
    commanded_at: null,
    acknowledged_at: null,
    acknowledged_result: null,
    output_at: null,
    output_us: null,
    output_evidence: null,
    sensed_at: null,
    gripper_used_by: null,
    pictures: [],
    target: null,
    planned_latitude_deg: null,
    planned_longitude_deg: null,
    latitude_deg: null,
    longitude_deg: null,
    relative_altitude_m: null,
    absolute_altitude_m: null,
    heading_deg: null,
    landed: null,
    gnss_fix: null,
    gnss_satellites: null,
    gnss_hdop: null,
    battery_percent: null,
    ground_speed_m_s: null,
    offset_m: null,
    ...fields,
  };
}

export function sampleConsent(fields: Partial<ConsentRecord> = {}): ConsentRecord {
  return {
    state: "asked",
    question: 1,
    asked_at: 180,
    deadline_at: 200,
    checked: null,
    answered_at: null,
    answered_by: null,
    comment: "",
    reason: null,
    ...fields,
  };
}

export function sampleRun(fields: Partial<Run> = {}): Run {
  return {
    id: "r1",
    plan_id: "p1",
    plan_hash: "",
    vehicle_id: "v1",
    vehicle_uid: null,
    vehicle_type: null,
    firmware: null,
    link_security: "pinned",
    state: "flying",
    reason: null,
    item_id: null,
    flown_item_ids: [],
    reached_seq: null,
    mission_id: null,
    mission_hash: null,
    upload_percent: null,
    requested_by: "local",
    start_requested: false,
    wind: null,
    commanded: null,
    change: null,
    changing: null,
    changes: 0,
    flown_before_change: 0,
    continues: null,
    continued_by: null,
    taken_over: null,
    rally: null,
    drops: [sampleDrop()],
    created_at: 100,
    updated_at: 100,
    started_at: null,
    ended_at: null,
    compiled_home: null,
    home: null,
    last_position: null,
    ...fields,
  };
}

/** What a test says of an event: as much of its data as it is about. */
export type EventFields = Partial<Omit<StreamEvent, "kind" | "data">> & { kind?: EventKind; data?: object };

export function sampleEvent(seq: number, fields: EventFields = {}): EventFrame["event"] {
  return {
    seq,
    position: seq,
    time: 1_000 + seq,
    kind: "service.started",
    version: 1,
    gateway: "gw1",
    vehicle_id: null,
    run_id: null,
    data: {},
    hash: "",
    ...fields,
  } as EventFrame["event"];
}
