/**
 * Measurements in words, in the units that the operator has chosen: what calls these in a component or an effect
 * follows a switch.
 */

import { signal } from "@preact/signals";

/** The mark for "not known": never a zero. */
export const UNKNOWN_VALUE = "–";

interface Unit {
  readonly name: string;
  /** How many of the SI unit it is. */
  readonly is: number;
}

interface System {
  readonly label: string;
  readonly short: Unit;
  readonly long: Unit;
  /** From here on (in metres) distances are said in the long unit. */
  readonly long_from_m: number;
  readonly speed: Unit;
  readonly climb: Unit;
}

const M: Unit = { name: "m", is: 1 };
const FT: Unit = { name: "ft", is: 0.3048 };
const KM: Unit = { name: "km", is: 1000 };
const NM: Unit = { name: "NM", is: 1852 };
const MI: Unit = { name: "mi", is: 1609.344 };
const M_S: Unit = { name: "m/s", is: 1 };
const KN: Unit = { name: "kn", is: 1852 / 3600 };
const MPH: Unit = { name: "mph", is: 0.44704 };
const FT_MIN: Unit = { name: "ft/min", is: 0.3048 / 60 };

/** What operators use: SI; feet and knots as in aviation; feet and miles per hour. */
export const UNIT_SYSTEMS = {
  metric: { label: "m, m/s", short: M, long: KM, long_from_m: 10_000, speed: M_S, climb: M_S },
  aviation: { label: "ft, kn", short: FT, long: NM, long_from_m: NM.is, speed: KN, climb: FT_MIN },
  miles: { label: "ft, mph", short: FT, long: MI, long_from_m: MI.is, speed: MPH, climb: FT_MIN },
} as const satisfies Record<string, System>;
export type UnitSystem = keyof typeof UNIT_SYSTEMS;

/** Chosen in the header; state/units.ts remembers it. */
export const unitSystem = signal<UnitSystem>("metric");

function system(): System {
  return UNIT_SYSTEMS[unitSystem.value];
}

/** A height: never in miles, however high. */
export function formatAltitude(value_m: number | null): string {
  return value_m === null ? UNKNOWN_VALUE : inUnit(value_m, system().short);
}

/** A height on the map, where decimals would only flicker. */
export function formatWholeAltitude(value_m: number): string {
  const { name, is } = system().short;
  return `${grouped(value_m / is, 0)} ${name}`;
}

/** A way over ground, short or long. */
export function formatDistance(value_m: number | null): string {
  if (value_m === null) return UNKNOWN_VALUE;
  const { short, long, long_from_m } = system();
  return Math.abs(value_m) >= long_from_m ? `${grouped(value_m / long.is, 1)} ${long.name}` : inUnit(value_m, short);
}

export function formatSpeed(value_m_s: number | null): string {
  if (value_m_s === null) return UNKNOWN_VALUE;
  const { name, is } = system().speed;
  return `${steady(value_m_s / is, 1)} ${name}`;
}

export function formatClimbRate(value_m_s: number | null): string {
  if (value_m_s === null) return UNKNOWN_VALUE;
  const { name, is } = system().climb;
  return is === 1 ? `${steady(value_m_s, 1)} ${name}` : `${grouped(Math.round(value_m_s / is / 10) * 10, 0)} ${name}`;
}

/**
 * Metres for the nearest round distance (1, 2 or 5 of the unit, times ten to some power) that is at least `least_m`.
 */
export function roundDistance(least_m: number): number {
  const { short, long, long_from_m } = system();
  const unit = least_m >= long_from_m / 2 ? long.is : short.is;
  const least = least_m / unit;
  const power = 10 ** Math.floor(Math.log10(Math.max(least, 0.1)));
  return ([1, 2, 5, 10].find((n) => n * power >= least * 0.999) ?? 10) * power * unit;
}

/** A field of a plan, which is in metres or m/s, as it is in the chosen units; empty if these are the plan's own. */
export function inPageUnits(unit: string, value: unknown): string {
  if (unitSystem.value === "metric" || typeof value !== "number" || !Number.isFinite(value)) return "";
  if (unit === "m") return formatAltitude(value);
  return unit === "m/s" ? formatSpeed(value) : "";
}

/** Under a minute with a decimal if it has one, then minutes and seconds, hours and minutes, days and hours. */
export function formatDuration(value: number | null): string {
  if (value === null) return UNKNOWN_VALUE;
  if (value < 60) return `${trimmed(value, 1)} s`;
  const whole = Math.round(value);
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  if (h >= 24) return `${Math.floor(h / 24)} d ${h % 24} h`;
  return h > 0 ? `${h} h ${String(m).padStart(2, "0")} min` : `${m} min ${String(s).padStart(2, "0")} s`;
}

export function formatPercent(value: number | null): string {
  return value === null ? UNKNOWN_VALUE : `${Math.round(value)}%`;
}

export function formatHeading(value: number | null): string {
  return value === null ? UNKNOWN_VALUE : `${String(Math.round(value) % 360).padStart(3, "0")}°`;
}

/** An age, coarse enough to be read while it grows: 0.4 s, 12 s, 3 min. */
export function formatAge(value_s: number | null): string {
  if (value_s === null) return "never";
  if (value_s < 10) return `${Math.max(0, value_s).toFixed(1)} s`;
  if (value_s < 120) return `${Math.round(value_s)} s`;
  if (value_s < 7200) return `${Math.round(value_s / 60)} min`;
  return `${Math.round(value_s / 3600)} h`;
}

/** The age of a heartbeat, which comes each second: only what is longer than that is news. */
export function formatLinkAge(value_s: number | null): string {
  return value_s !== null && value_s < 2 ? "< 2 s" : formatAge(value_s);
}

/** Degrees to a tenth of a metre. */
export function formatPosition({
  latitude_deg,
  longitude_deg,
}: {
  latitude_deg: number;
  longitude_deg: number;
}): string {
  return `${latitude_deg.toFixed(6)}, ${longitude_deg.toFixed(6)}`;
}

/** Unix seconds as local time of day. */
export function formatClock(unix_s: number): string {
  return new Date(unix_s * 1000).toLocaleTimeString("en-GB");
}

/** Unix seconds as local time of day, after the date unless it is `today` (a toDateString): "3 Jul 07:10:34". */
export function formatMoment(unix_s: number, today: string): string {
  const at = new Date(unix_s * 1000);
  if (at.toDateString() === today) return formatClock(unix_s);
  const year = today.endsWith(String(at.getFullYear())) ? {} : ({ year: "numeric" } as const);
  return `${at.toLocaleDateString("en-GB", { day: "numeric", month: "short", ...year })} ${formatClock(unix_s)}`;
}

/** Unix seconds in full, for a tooltip. */
export function formatTimestamp(unix_s: number): string {
  return new Date(unix_s * 1000).toISOString().replace("T", " ").replace("Z", " UTC");
}

function inUnit(value_m: number, { name, is }: Unit): string {
  const value = value_m / is;
  return `${grouped(value, Math.abs(value) < 10 ? 1 : 0)} ${name}`;
}

/** With as many decimals always, so that it does not jump while it changes; and no "-0.0". */
function steady(value: number, decimals: number): string {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? (0).toFixed(decimals) : text;
}

/** Thousands apart by a thin space, as in 12 300 ft. */
function grouped(value: number, decimals: number): string {
  const text = trimmed(value, decimals);
  return text.replace(/\d{5,}/, (digits) => digits.replace(/\B(?=(\d{3})+$)/g, "\u202f"));
}

function trimmed(value: number, decimals: number): string {
  const text = value.toFixed(decimals).replace(/\.0+$/, "");
  return text === "-0" ? "0" : text;
}
