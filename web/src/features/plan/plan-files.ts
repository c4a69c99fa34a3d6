/** Plans to and from files of this computer, also those of other software. */

import { signal } from "@preact/signals";
import { api } from "../../api/client";
import { type ProblemError, toProblem } from "../../api/problem";
import type { ConversionFinding, ForeignFormat, PlanDocument, TargetFormat } from "../../api/types";
import { vehicleTypeLabel } from "../../format/labels";
import { reportProblem } from "../../store/notices";
import { selectedVehicle } from "../../store/selection";
import { saveFile } from "../../ui/save-file";
import { omitNulls, viewPlan } from "./document";
import { storedId } from "./draft";
import { draftGeneration, draftText, draftView, openDraft, planText } from "./draft-text";

/** Larger files are no plans: the service takes no more. */
const MAX_BYTES = 1_048_576;

/** What came of a conversion. It is about the plan that was open then, and goes with it. */
interface ConversionResult {
  readonly title: string;
  readonly draft: number;
  readonly findings: readonly ConversionFinding[];
  readonly refused: ProblemError | null;
}

export const conversion = signal<ConversionResult | null>(null);

let newest = 0; // of two files that are read at once the later one is meant

export async function openFile(file: File | undefined): Promise<void> {
  if (!file) return;
  if (file.size > MAX_BYTES)
    return reportProblem(`Open ${file.name}`, new Error("The file exceeds the size limit of a plan (1 MiB)."));
  const number = ++newest;
  const text = await file.text();
  if (number !== newest) return;
  const format = foreignFormat(text);
  if (format !== null) return convert(file, format, number);
  conversion.value = null;
  openDraft(text);
}

/** The service reads it; what it refuses changes nothing here. */
async function convert(file: File, format: ForeignFormat, number: number): Promise<void> {
  const about = { draft: draftGeneration.value, findings: [] };
  try {
    const vehicle_type = selectedVehicle.value?.vehicle_type ?? null;
    const { plan, findings } = await api.convertPlan(file, { format, name: nameFromFile(file.name), vehicle_type });
    if (number !== newest) return;
    openDraft(planText(omitNulls(plan)));
    conversion.value = {
      title: `Imported ${file.name} (${FORMAT_NAMES[format]}) as a plan for a ${typeName(plan)}`,
      draft: draftGeneration.value,
      findings,
      refused: null,
    };
  } catch (error) {
    if (number === newest)
      conversion.value = { ...about, title: `${file.name} cannot be imported`, refused: toProblem(error) };
  }
}

/** Said, because it may have come from the chosen vehicle and not from the file. */
function typeName(plan: PlanDocument): string {
  return vehicleTypeLabel(viewPlan(plan).vehicleType).toLowerCase();
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
    draftGeneration.value,
    `${fileStem(draftView.value?.name ?? "plan")}.${SUFFIXES[format]}`,
  ];
  if (id === null) return;
  try {
    const [content, { exports }] = await Promise.all([api.exportFile(id, format), api.exports(id)]);
    saveFile(name, content, content.type);
    const findings = exports.find((one) => one.format === format)?.findings ?? [];
    conversion.value = { title: `Exported ${name} (${FORMAT_NAMES[format]})`, draft, findings, refused: null };
  } catch (error) {
    reportProblem(`Save ${name}`, error);
  }
}

// Which documents of other software the service converts, recognised by their content. Pure.

const FORMAT_NAMES: Readonly<Record<ForeignFormat | TargetFormat, string>> = {
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
    return null; // an incomplete plan is edited as text
  }
}

/** "Field 3.waypoints" -> "Field 3": the name of a plan whose file has none. */
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
