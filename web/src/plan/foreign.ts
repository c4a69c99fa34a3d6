/** Which documents of other software the service is asked to read, told by their content. Pure. */

export type ForeignFormat = "qgc" | "waypoints";

export const FORMAT_NAMES: Readonly<Record<string, string>> = {
  plan: "Waydrop plan",
  qgc: "QGroundControl .plan",
  waypoints: "waypoint file",
  geojson: "GeoJSON",
  kml: "KML",
};

/** What a text is if it is no plan of Waydrop's; null: it is opened as it is. */
export function foreignFormat(text: string): ForeignFormat | null {
  const start = text.replace(/^\uFEFF/, "").trimStart();
  if (start.startsWith("QGC WPL")) return "waypoints";
  if (!start.startsWith("{")) return null;
  try {
    const doc: unknown = JSON.parse(start);
    return typeof doc === "object" && doc !== null && "fileType" in doc ? "qgc" : null;
  } catch {
    return null; // a half-written plan is mended as a text
  }
}

/** "Field 3.waypoints" -> "Field 3": the name of a plan whose file says none. */
export function nameFromFile(file: string): string {
  return file.replace(/\.[^.]*$/, "").trim().slice(0, 200) || "Plan";
}

/** A name that every file system takes. */
export function fileStem(planName: string): string {
  return planName.replaceAll(/[^\p{L}\p{N}]+/gu, "-").replaceAll(/^-|-$/g, "").toLowerCase() || "plan";
}
