import { useComputed } from "@preact/signals";
import { useState } from "preact/hooks";
import { vehicleTypeLabel } from "../../format/labels";
import { hasRole } from "../../store/principal";
import { attention, showPanel } from "../../store/selection";
import { dispatch, live, vehicleIds, vehicles } from "../../store/store";
import { queueDraft, sendingPlan } from "../plan/draft";
import { parseJobForm } from "./job-form";
import { expandedJob } from "./jobs";
import { useQueueCheck } from "./queue-check";

const ANY = "any";

/** Makes a job of the plan in the editor: for any suitable vehicle, or for one. */
export function QueueForm() {
  const [open, setOpen] = useState(false);
  const [vehicle, setVehicle] = useState(ANY);
  const [priority, setPriority] = useState("0");
  const [deadline, setDeadline] = useState("");
  const [autoStart, setAutoStart] = useState(false);
  const form = parseJobForm({ vehicle, priority, deadline, autoStart });
  const check = useQueueCheck(open && "order" in form ? form.order : null);
  if (!hasRole("dispatcher")) return null;
  const ready = live.value && !sendingPlan.value && check.canQueue && "order" in form;
  const submit = async (event: Event) => {
    event.preventDefault();
    const isWatched = attention();
    const job = ready ? await queueDraft(form.order) : null;
    if (job === null) return;
    dispatch({ type: "jobs_read", jobs: [job], queues: [] });
    expandedJob.value = job.id;
    if (isWatched()) showPanel("jobs");
  };
  return (
    <details class="queue-job" open={open} onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary>Queue as a job</summary>
      <form aria-label="Queue as a job" onSubmit={(event) => void submit(event)}>
        <VehicleChoice value={vehicle} onChange={setVehicle} />
        <label>
          Priority (−100 to 100, higher first)
          <input inputMode="numeric" value={priority} onInput={(event) => setPriority(event.currentTarget.value)} />
        </label>
        <label>
          Latest start (optional)
          <input type="datetime-local" value={deadline} onInput={(event) => setDeadline(event.currentTarget.value)} />
        </label>
        <label class="check">
          <input type="checkbox" checked={autoStart} onChange={(event) => setAutoStart(event.currentTarget.checked)} />
          Start automatically after the upload
        </label>
        {"error" in form ? (
          <p class="form-problem">{form.error}</p>
        ) : (
          <p class={`queue-check tone-${check.tone}`} role="status">
            {check.text}
          </p>
        )}
        <button type="submit" class="small" disabled={!ready}>
          Queue job
        </button>
      </form>
    </details>
  );
}

function VehicleChoice({ value, onChange }: { value: string; onChange: (id: string) => void }) {
  const fleet = useComputed(() =>
    vehicleIds.value.map((id) => [id, vehicles.value[id]?.vehicle_type ?? null] as const),
  );
  return (
    <label>
      Flown by
      <select value={value} onChange={(event) => onChange(event.currentTarget.value)}>
        <option value={ANY}>Any suitable vehicle</option>
        {fleet.value.map(([id, type]) => (
          <option key={id} value={id}>
            {id} · {vehicleTypeLabel(type)}
          </option>
        ))}
      </select>
    </label>
  );
}
