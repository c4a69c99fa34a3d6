/** Places in words: coordinates in degrees, or in degrees, minutes and seconds, and plus codes. Pure. */

import type { Point } from "../../geo/geometry";

/** The place that a text names, null if it is none. A short plus code is the one that is nearest to `near`. */
export function findPlace(text: string, near: Point): Point | null {
  return plusCode(text.trim().toUpperCase(), near) ?? coordinates(text.trim().toUpperCase());
}

const NUMBER = /\d+(?:\.\d+)?/g;
/** A sign, up to three numbers with their marks, and a letter: of latitude or longitude. */
const PART = /^([NSEW])?\s*([-−+])?\s*((?:\d+(?:\.\d+)?\s*[°º:'’′"”″]*\s*){1,3}?)\s*([NSEW])?$/;

/** "47.39, 8.54", "47°23'51.9\"N 8°32'44.1\"E": latitude first, unless letters say otherwise. */
function coordinates(text: string): Point | null {
  const parts = splitInTwo(text)?.map(angle);
  const [first, second] = parts ?? [];
  if (!first || !second) return null;
  const isSwapped = first.axis === "lon" || second.axis === "lat";
  const [lat, lon] = isSwapped ? [second, first] : [first, second];
  if (lat.axis === "lon" || lon.axis === "lat") return null;
  return Math.abs(lat.value) <= 90 && Math.abs(lon.value) <= 180 ? [lon.value, lat.value] : null;
}

/** At a comma or semicolon, else after the first letter of a direction, else between two numbers. */
function splitInTwo(text: string): [string, string] | null {
  const [first, second, ...more] = text.split(/[,;]/);
  if (first !== undefined && second !== undefined) return more.length === 0 ? [first.trim(), second.trim()] : null;
  const lettered =
    /^(.*\d[^NSEW\d]*[NSEW])\s*([^NSEW]*\d[^NSEW\d]*[NSEW])$/.exec(text) ?? /^([NS][^NSEW]+)([EW].+)$/.exec(text);
  const halves = lettered ?? /^(\S+)\s+(\S+)$/.exec(text);
  return halves?.[1] !== undefined && halves[2] !== undefined ? [halves[1].trim(), halves[2].trim()] : null;
}

function angle(text: string): { readonly value: number; readonly axis: "lat" | "lon" | null } | null {
  const found = PART.exec(text);
  const [degrees = NaN, minutes = 0, seconds = 0] = found?.[3]?.match(NUMBER)?.map(Number) ?? [];
  const letter = found?.[1] ?? found?.[4];
  if (found === null || Number.isNaN(degrees) || minutes >= 60 || seconds >= 60) return null;
  const isNegative = letter === "S" || letter === "W" || "-−".includes(found[2] ?? "+");
  const size = degrees + minutes / 60 + seconds / 3600;
  const axis = letter === undefined ? null : "NS".includes(letter) ? "lat" : "lon";
  return { value: isNegative ? -size : size, axis };
}

// Open Location Codes (plus codes), as their specification defines them.

const DIGITS = "23456789CFGHJMPQRVWX";
const BASE = DIGITS.length;
const CODE = new RegExp(`^((?:[${DIGITS}]{2}){1,4})(0*)\\+([${DIGITS}]{2,7})?(?:\\s|$)`);
const BEFORE_PLUS = 8;
const PAIRS = 5;

function plusCode(text: string, near: Point): Point | null {
  const found = CODE.exec(text);
  if (found === null) return null;
  const [, head = "", zeros = "", tail = ""] = found;
  if (zeros !== "") return head.length + zeros.length === BEFORE_PLUS && tail === "" ? decoded(head) : null;
  const missing = BEFORE_PLUS - head.length;
  if (missing === 0) return decoded(head + tail);
  if (tail === "") return null;
  const [lon, lat] = decoded(prefixOf(near, missing) + head + tail);
  const step = BASE ** (2 - missing / 2);
  return [lon + step * Math.round((near[0] - lon) / step), lat + step * Math.round((near[1] - lat) / step)];
}

/** The middle of the area that a code names. */
function decoded(code: string): Point {
  let [lat, lon, height, width] = [-90, -180, BASE ** 2, BASE ** 2];
  const pairs = code.slice(0, 2 * PAIRS);
  for (let i = 0; i < pairs.length; i += 2) {
    [height, width] = [height / BASE, width / BASE];
    lat += height * DIGITS.indexOf(pairs.charAt(i));
    lon += width * DIGITS.indexOf(pairs.charAt(i + 1));
  }
  for (const digit of code.slice(2 * PAIRS)) {
    [height, width] = [height / 5, width / 4];
    lat += height * Math.floor(DIGITS.indexOf(digit) / 4);
    lon += width * (DIGITS.indexOf(digit) % 4);
  }
  return [lon + width / 2, lat + height / 2];
}

function prefixOf([lon, lat]: Point, digits: number): string {
  let [north, east, size, code] = [Math.min(lat, 89.999) + 90, (lon + 540) % 360, BASE, ""];
  while (code.length < digits) {
    code += DIGITS.charAt(Math.floor(north / size)) + DIGITS.charAt(Math.floor(east / size));
    [north, east, size] = [north % size, east % size, size / BASE];
  }
  return code;
}
