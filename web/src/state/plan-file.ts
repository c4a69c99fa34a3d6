/** Plans to and from files of this computer. */

import { draftText, draftView, openDraft } from "./draft-text";
import { report } from "./notices";
import { saveFile } from "./save-file";

/** Larger files are no plans: the service takes no more. */
const MAX_BYTES = 1_048_576;

export async function openFile(file: File | undefined): Promise<void> {
  if (!file) return;
  if (file.size > MAX_BYTES) return report(`Open ${file.name}`, new Error("The file is larger than a plan can be (1 MiB)."));
  openDraft(await file.text());
}

/** The draft as a file, just as it is written. */
export function savePlan(): void {
  const name = (draftView.value?.name ?? "plan").replaceAll(/[^\p{L}\p{N}]+/gu, "-").replaceAll(/^-|-$/g, "").toLowerCase();
  saveFile(`${name || "plan"}.json`, draftText.value, "application/json");
}
