/** Measurements in words. One place, so that a unit switch has one place to live. Pure. */

/** The mark for "not known": never a zero. */
export const UNKNOWN = "–";

export function metres(value: number | null): string {
  if (value === null) return UNKNOWN;
  if (Math.abs(value) >= 10_000) return `${(value / 1000).toFixed(1)} km`;
  return `${trimmed(value, Math.abs(value) < 10 ? 1 : 0)} m`;
}

export function speed(value: number | null): string {
  return value === null ? UNKNOWN : `${value.toFixed(1)} m/s`;
}

/** Under a minute with a decimal if it has one, then minutes and seconds. */
export function seconds(value: number | null): string {
  if (value === null) return UNKNOWN;
  if (value < 60) return `${trimmed(value, 1)} s`;
  const whole = Math.round(value);
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return h > 0 ? `${h} h ${String(m).padStart(2, "0")} min` : `${m} min ${String(s).padStart(2, "0")} s`;
}

export function percent(value: number | null): string {
  return value === null ? UNKNOWN : `${Math.round(value)}%`;
}

export function heading(value: number | null): string {
  return value === null ? UNKNOWN : `${String(Math.round(value) % 360).padStart(3, "0")}°`;
}

export function coordinate(value: number | null): string {
  return value === null ? UNKNOWN : `${value.toFixed(6)}°`;
}

/** An age, coarse enough to be read while it grows: 0.4 s, 12 s, 3 min. */
export function age(value_s: number | null): string {
  if (value_s === null) return "never";
  if (value_s < 10) return `${Math.max(0, value_s).toFixed(1)} s`;
  if (value_s < 120) return `${Math.round(value_s)} s`;
  if (value_s < 7200) return `${Math.round(value_s / 60)} min`;
  return `${Math.round(value_s / 3600)} h`;
}

/** Unix seconds as local time of day. */
export function clockTime(unix_s: number): string {
  return new Date(unix_s * 1000).toLocaleTimeString("en-GB");
}

/** Unix seconds in full, for a tooltip. */
export function fullTime(unix_s: number): string {
  return new Date(unix_s * 1000).toISOString().replace("T", " ").replace("Z", " UTC");
}

function trimmed(value: number, decimals: number): string {
  return value.toFixed(decimals).replace(/\.0+$/, "");
}
