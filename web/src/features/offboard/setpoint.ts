/** From what the controls ask for to the setpoint that says it, within limits that the page can only lower. Pure. */

import type { OffboardLimits, PositionGlobal, VehicleType, VelocityBody } from "../../api/types";
import type { Point } from "../../geo/geometry";
import { type Axes, NEUTRAL } from "./controls";

export type Setpoint = VelocityBody | PositionGlobal;

export const SPEED_PRESETS = ["slow", "normal"] as const;
export type SpeedPreset = (typeof SPEED_PRESETS)[number];

/** The most that each axis asks for. */
interface Speeds {
  readonly speed_m_s: number;
  readonly climb_m_s: number;
  readonly descend_m_s: number;
  readonly turn_deg_s: number;
}

const PAGE: Readonly<Record<SpeedPreset, Speeds>> = {
  slow: { speed_m_s: 1.5, climb_m_s: 0.7, descend_m_s: 0.5, turn_deg_s: 20 },
  normal: { speed_m_s: 5, climb_m_s: 2, descend_m_s: 1.5, turn_deg_s: 45 },
};

/** The page's own speeds, or the service's limits where these are lower. */
export function presetSpeeds(pace: SpeedPreset, limits: OffboardLimits | null): Speeds {
  const page = PAGE[pace];
  return {
    speed_m_s: Math.min(page.speed_m_s, limits?.max_speed_m_s ?? Infinity),
    climb_m_s: Math.min(page.climb_m_s, limits?.max_climb_m_s ?? Infinity),
    descend_m_s: Math.min(page.descend_m_s, limits?.max_descend_m_s ?? Infinity),
    turn_deg_s: page.turn_deg_s,
  };
}

/** A rover has no climb, and PX4 lets it choose its heading. */
export function velocitySetpoint(axes: Axes, speeds: Speeds, type: VehicleType): VelocityBody {
  const drives = type === "rover";
  const down = axes.up > 0 ? -axes.up * speeds.climb_m_s : -axes.up * speeds.descend_m_s;
  return {
    type: "velocity_body",
    forward_m_s: rounded(axes.forward * speeds.speed_m_s),
    right_m_s: rounded(axes.right * speeds.speed_m_s),
    down_m_s: drives ? 0 : rounded(down),
    yaw_deg: null,
    yawspeed_deg_s: drives ? null : rounded(axes.clockwise * speeds.turn_deg_s),
  };
}

/** Stand still. */
export function zeroSetpoint(speeds: Speeds, type: VehicleType): VelocityBody {
  return velocitySetpoint(NEUTRAL, speeds, type);
}

/** Go to a place at this altitude above sea level, at the vehicle's own speed, and stay there. */
export function positionSetpoint([longitude_deg, latitude_deg]: Point, altitude_m: number): PositionGlobal {
  return {
    type: "position_global",
    latitude_deg,
    longitude_deg,
    altitude_m,
    altitude_type: "amsl",
    yaw_deg: null,
    yawspeed_deg_s: null,
  };
}

function rounded(value: number): number {
  return Math.round(value * 1000) / 1000 || 0; // and no -0
}
