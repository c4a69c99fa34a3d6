/** Plans to and from files of this computer, also those of other software. */

import { signal } from "@preact/signals";
import { api } from "../../api/client";
import { asProblem, type ProblemError } from "../../api/problem";
import type { ConversionFinding, ForeignFormat, PlanDocument, TargetFormat } from "../../api/types";
import { vehicleTypeName } from "../../format/labels";
import { report } from "../../store/notices";
import { selectedVehicle } from "../../store/selection";
import { saveFile } from "../../ui/save-file";
import { viewPlan, withoutNulls } from "./document";
import { storedId } from "./draft";
import { draftNumber, draftText, draftView, openDraft, planText } from "./draft-text";

/** Larger files are no plans: the service takes no more. */
const MAX_BYTES = 1_048_576;

/** What came of a conversion. It is about the plan that was open then, and goes with it. */
export interface Converted {
  readonly title: string;
  readonly draft: number;
  readonly findings: readonly ConversionFinding[];
  readonly refused: ProblemError | null;
}

export const converted = signal<Converted | null>(null);

let newest = 0; // of two files that are read at once the later one is meant

export async function openFile(file: File | undefined): Promise<void> {
  if (!file) return;
  if (file.size > MAX_BYTES)
    return report(`Open ${file.name}`, new Error("The file is larger than a plan can be (1 MiB)."));
  const number = ++newest;
  const text = await file.text();
  if (number !== newest) return;
  const format = foreignFormat(text);
  if (format !== null) return convert(file, format, number);
  converted.value = null;
  openDraft(text);
}

/** The service reads it; what it refuses changes nothing here. */
async function convert(file: File, format: ForeignFormat, number: number): Promise<void> {
  const about = { draft: draftNumber.value, findings: [] };
  try {
    const { plan, findings } = await api.convertPlan(
      file,
      format,
      nameFromFile(file.name),
      selectedVehicle.value?.vehicle_type ?? null,
    );
    if (number !== newest) return;
    openDraft(planText(withoutNulls(plan)));
    converted.value = {
      title: `${file.name} was read as a ${FORMAT_NAMES[format]}, for a ${typeName(plan)}`,
      draft: draftNumber.value,
      findings,
      refused: null,
    };
  } catch (error) {
    if (number === newest)
      converted.value = { ...about, title: `${file.name} cannot become a plan`, refused: asProblem(error) };
  }
}

/** Said, because it may have come from the chosen vehicle and not from the file. */
function typeName(plan: PlanDocument): string {
  return vehicleTypeName(viewPlan(plan).vehicleType).toLowerCase();
}

/** The draft as a file, just as it is written. */
export function savePlan(): void {
  saveFile(`${fileStem(draftView.value?.name ?? "plan")}.json`, draftText.value, "application/json");
}

const SUFFIXES: Readonly<Record<TargetFormat, string>> = { qgc: "plan", geojson: "geojson", kml: "kml" };

/** The stored plan as a document of other software, and what that document leaves out. */
export async function exportPlan(format: TargetFormat): Promise<void> {
  const [id, draft, name] = [
    storedId.value,
    draftNumber.value,
    `${fileStem(draftView.value?.name ?? "plan")}.${SUFFIXES[format]}`,
  ];
  if (id === null) return;
  try {
    const [content, { exports }] = await Promise.all([api.exportFile(id, format), api.exports(id)]);
    saveFile(name, content, content.type);
    const findings = exports.find((one) => one.format === format)?.findings ?? [];
    converted.value = { title: `${name} was saved as ${FORMAT_NAMES[format]}`, draft, findings, refused: null };
  } catch (error) {
    report(`Save ${name}`, error);
  }
}

// Which documents of other software the service is asked to read, told by their content. Pure.

export const FORMAT_NAMES: Readonly<Record<ForeignFormat | TargetFormat | "plan", string>> = {
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
  return (
    file
      .replace(/\.[^.]*$/, "")
      .trim()
      .slice(0, 200) || "Plan"
  );
}

/** A name that every file system takes. */
export function fileStem(planName: string): string {
  return (
    planName
      .replaceAll(/[^\p{L}\p{N}]+/gu, "-")
      .replaceAll(/^-|-$/g, "")
      .toLowerCase() || "plan"
  );
}
