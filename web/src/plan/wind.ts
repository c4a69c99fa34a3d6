/** A wind as it is typed: where it comes from, and how strong, in the units of the page. Pure. */

import { SYSTEMS, type SystemName } from "../format/units";

/** As weather reports and the API say it. */
export interface Wind {
  readonly from_deg: number;
  readonly speed_m_s: number;
}

/** `units`: those in which the speed was typed, so that a switch of units changes no wind. */
export interface WindTexts {
  readonly from: string;
  readonly speed: string;
  readonly units: SystemName;
}

export const CALM: WindTexts = { from: "", speed: "", units: "metric" };
/** The service takes no stronger one. */
const STRONGEST_M_S = 75;

export type TypedWind = { readonly wind: Wind | null } | { readonly error: string };

/** Nothing typed is calm air. */
export function windOf({ from, speed, units }: WindTexts): TypedWind {
  if (from.trim() === "" && speed.trim() === "") return { wind: null };
  const { is, name } = SYSTEMS[units].speed;
  const [from_deg, typed] = [numberOf(from), numberOf(speed)];
  if (from_deg === null || from_deg < 0 || from_deg > 360) return { error: "Where does the wind come from? 0 to 360 degrees, 270 is a west wind." };
  const speed_m_s = typed === null ? null : typed * is;
  if (speed_m_s === null || speed_m_s < 0 || speed_m_s > STRONGEST_M_S) return { error: `How strong is the wind? 0 to ${Math.floor(STRONGEST_M_S / is)} ${name}.` };
  return { wind: { from_deg, speed_m_s } };
}

/** The speed's text in other units; one that is no number stays as it is. */
export function speedText({ speed, units }: WindTexts, shown: SystemName): string {
  const typed = numberOf(speed);
  if (units === shown || typed === null) return speed;
  return String(Number(((typed * SYSTEMS[units].speed.is) / SYSTEMS[shown].speed.is).toFixed(1)));
}

function numberOf(text: string): number | null {
  const value = text.trim() === "" ? Number.NaN : Number(text.trim().replace(",", "."));
  return Number.isFinite(value) ? value : null;
}
