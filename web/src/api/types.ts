/** The nouns of the API, as the service sends them. Units are in the names; null means "not known". */

export type VehicleType = "multicopter" | "fixed_wing" | "vtol" | "rover" | "airship";

export interface GlobalPosition {
  latitude_deg: number;
  longitude_deg: number;
  altitude_m: number;
}

export interface VehicleState {
  connected: boolean;
  mode: string | null;
  armed: boolean | null;
  landed: string;
  in_failsafe: boolean;
  latitude_deg: number | null;
  longitude_deg: number | null;
  absolute_altitude_m: number | null;
  relative_altitude_m: number | null;
  velocity_north_m_s: number | null;
  velocity_east_m_s: number | null;
  velocity_down_m_s: number | null;
  heading_deg: number | null;
  position_age_s: number | null;
  heartbeat_age_s: number | null;
  battery_percent: number | null;
  home: GlobalPosition | null;
  mission_seq: number | null;
  mission_total: number | null;
  mission_state: string;
  mission_id: number | null;
  vtol_state: string | null;
}

export interface Vehicle {
  id: string;
  system_id: number;
  vehicle_type: VehicleType | null;
  firmware: string | null;
  uid: string | null;
  connection: string;
  quarantined: string | null;
  state: VehicleState;
  run_id: string | null;
}

export type RunState =
  | "created"
  | "uploading"
  | "uploaded"
  | "starting"
  | "flying"
  | "at_drop"
  | "paused"
  | "returning"
  | "landed"
  | "completed"
  | "aborted"
  | "failed"
  | "lost";

export interface DropRecord {
  plan_item_id: string;
  supervised: boolean;
  phase: "waiting" | "holding" | "releasing" | "resuming" | "done";
  outcome: "pending" | "released" | "kept" | "unknown";
  certainty: "sensed" | "acknowledged" | "inferred" | "none";
  reason: string;
  attempts: number;
  commanded_at: number | null;
  acknowledged_at: number | null;
  acknowledged_result: string | null;
  output_at: number | null;
  output_us: number | null;
  sensed_at: number | null;
  ground_speed_m_s: number | null;
  offset_m: number | null;
  latitude_deg: number | null;
  longitude_deg: number | null;
}

export interface Run {
  id: string;
  plan_id: string;
  vehicle_id: string;
  state: RunState;
  item_id: string | null;
  flown_item_ids: string[];
  reason: string;
  created_at: number;
  updated_at: number;
  started_at: number | null;
  ended_at: number | null;
  upload_percent: number | null;
  drops: DropRecord[];
}

export interface Finding {
  code: string;
  severity: "error" | "warning";
  pointer: string;
  message: string;
  hint: string;
  item_id: string | null;
}

/** A plan document as a dispatcher wrote it; what is in it is read by plan/document.ts. */
export type Plan = Record<string, unknown>;

/** The prediction for a plan, read by plan/timeline.ts; null where none can be made. */
export type Timeline = Record<string, unknown> | null;

export interface PlanCheck {
  findings: Finding[];
  timeline: Timeline;
}

export interface PlanSummary {
  id: string;
  hash: string;
  name: string;
  vehicle_type: string;
  created_at: number;
  created_by: string;
}

export interface StoredPlan extends PlanSummary {
  plan: Plan;
  findings: Finding[];
  timeline: Timeline;
}
