/** A plan for a first flight: a drop beside the place where the vehicle stands. Pure. */

import type { PlanDocument, Vehicle } from "../../api/types";
import { offset } from "../../geo/geometry";

const AWAY_M = 80;
const HEIGHT_M = 15;

export function examplePlan(home: NonNullable<Vehicle["state"]["home"]>): PlanDocument {
  const [longitude, latitude] = offset([home.longitude_deg, home.latitude_deg], AWAY_M, 45);
  const place = { latitude_deg: rounded(latitude), longitude_deg: rounded(longitude) };
  return {
    version: 1,
    name: "First delivery",
    vehicle_type: "multicopter",
    home: {
      latitude_deg: home.latitude_deg,
      longitude_deg: home.longitude_deg,
      absolute_altitude_m: home.altitude_m,
    },
    limits: { max_relative_altitude_m: 60, max_distance_m: 500 },
    items: [
      { id: "takeoff", type: "takeoff", relative_altitude_m: HEIGHT_M },
      { id: "place", type: "waypoint", ...place, relative_altitude_m: HEIGHT_M },
      { id: "drop", type: "gripper", action: "release", release_motion: "stopped", max_offset_m: 2 },
      { id: "home", type: "return_to_launch" },
    ],
  };
}

function rounded(degrees: number): number {
  return Number(degrees.toFixed(7));
}
