import { useState } from "preact/hooks";
import { api } from "../api/client";
import type { Run } from "../api/types";
import { report } from "../state/notices";
import { saveFile } from "../state/save-file";
import { Icon } from "./icons";

/** Saves the delivery report as a file: a token goes with the request, which a plain link could not carry. */
export function DeliveryReportButton({ run }: { run: Run }) {
  const [busy, setBusy] = useState(false);
  const save = async () => {
    setBusy(true);
    try {
      saveFile(`delivery-report-${run.id}.html`, await api.deliveryReportPage(run.id), "text/html");
    } catch (error) {
      report("Delivery report", error);
    } finally {
      setBusy(false);
    }
  };
  return (
    <button type="button" class="small delivery-report" disabled={busy} onClick={() => void save()}>
      <Icon name="file" /> Save the delivery report
    </button>
  );
}
