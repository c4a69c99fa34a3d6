import { useState } from "preact/hooks";
import { api } from "../api/client";
import type { Run } from "../api/types";
import { report } from "../state/notices";
import { saveFile } from "../state/save-file";
import { Icon } from "./icons";

/** Saves the proof of delivery as a file: a token goes with the request, which a plain link could not carry. */
export function ProofButton({ run }: { run: Run }) {
  const [busy, setBusy] = useState(false);
  const save = async () => {
    setBusy(true);
    try {
      saveFile(`proof-${run.id}.html`, await api.proofSheet(run.id), "text/html");
    } catch (error) {
      report("Proof of delivery", error);
    } finally {
      setBusy(false);
    }
  };
  return (
    <button type="button" class="small proof" disabled={busy} onClick={() => void save()}>
      <Icon name="file" /> Save the proof of delivery
    </button>
  );
}
