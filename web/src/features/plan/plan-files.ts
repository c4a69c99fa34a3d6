/** Plans to and from files of this computer, also those of other software. */

import { signal } from "@preact/signals";
import { api } from "../../api/client";
import { ProblemError, toProblem } from "../../api/problem";
import type { ConversionFinding, ForeignFormat, PlanDocument, TargetFormat } from "../../api/types";
import { vehicleTypeLabel } from "../../format/labels";
import { reportProblem } from "../../store/notices";
import { selectedVehicle } from "../../store/selection";
import { saveFile } from "../../ui/save-file";
import { omitNulls, parsePlanText, viewPlan } from "./document";
import { storedId } from "./draft";
import { draftGeneration, draftText, draftView, markDraftSaved, openDraft, planText } from "./draft-text";

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
  const number = ++newest;
  try {
    if (file.size > MAX_BYTES) throw tooLarge(file.size);
    const text = await file.text();
    if (number !== newest) return;
    const format = foreignFormat(text);
    if (format !== null) return await convert(file, format, number);
    openDraft(planFileText(text));
    conversion.value = null;
  } catch (error) {
    reportProblem(`Open ${file.name}`, error);
  }
}

function tooLarge(bytes: number): ProblemError {
  const size = (Math.ceil((bytes / MAX_BYTES) * 10) / 10).toFixed(1);
  const hint = "Open a smaller file, or split the plan in two.";
  return new ProblemError(
    0,
    "file.too_large",
    "The file is too large",
    `It has ${size} MiB; the limit is 1 MiB.`,
    hint,
    [],
  );
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
  markDraftSaved(draftText.value);
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

/** What a text is if it is of other software; null: it is a plan of Waydrop's, or no document at all. */
export function foreignFormat(text: string): ForeignFormat | null {
  const start = text.replace(/^\uFEFF/, "").trimStart();
  if (start.startsWith("QGC WPL")) return "waypoints";
  if (!start.startsWith("{")) return null;
  try {
    const doc: unknown = JSON.parse(start);
    return typeof doc === "object" && doc !== null && "fileType" in doc ? "qgc" : null;
  } catch {
    return null;
  }
}

/** The text of a plan's file. Raises a problem if it is no JSON object: it would replace the draft and be no plan. */
export function planFileText(text: string): string {
  const content = text.replace(/^\uFEFF/, "");
  const parsed = parsePlanText(content);
  if (parsed !== null && "plan" in parsed) return content;
  const hint = `Open a plan of Waydrop (JSON), a ${FORMAT_NAMES.qgc} or a ${FORMAT_NAMES.waypoints}.`;
  throw new ProblemError(0, "file.not_a_plan", "The file is not a plan", whatItIs(content, parsed), hint, []);
}

function whatItIs(content: string, parsed: { readonly error: string } | null): string {
  if (parsed === null) return "It is empty.";
  if (content.trimStart().startsWith("<") && content.includes("<kml")) return "It is KML, which can only be exported.";
  return /[\0\uFFFD]/.test(content) ? "It is not a text file." : parsed.error;
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
