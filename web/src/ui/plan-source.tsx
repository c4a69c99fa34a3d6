import { useRef } from "preact/hooks";
import type { TargetFormat } from "../api/types";
import { fullTime } from "../format/units";
import { canStore, isStored, keepDraft, openStored } from "../state/draft";
import { draftText, openDraft } from "../state/draft-text";
import { startNewPlan } from "../state/editor";
import { exportPlan, openFile, savePlan } from "../state/plan-file";
import { readStoredPlans, storedPlans } from "../state/plans";
import { live } from "../state/store";
import { Icon } from "./icons";

/** Where a plan comes from: begun anew, picked from disk, or one that the service has. And where it goes to. */
export function PlanSource() {
  const written = draftText.value !== "";
  return (
    <section class="plan-source-tools" aria-label="Where the plan comes from">
      <button type="button" class="small" onClick={startNewPlan}>
        <Icon name="plus" size={15} />
        New plan
      </button>
      <FilePicker />
      <StoredPlans />
      {written && (
        <>
          <button type="button" class="small" disabled={!canStore.value} onClick={() => void keepDraft()}>
            <Icon name={isStored.value ? "check" : "store"} size={15} />
            {isStored.value ? "Stored" : "Store"}
          </button>
          <button type="button" class="small" onClick={savePlan}>
            <Icon name="save" size={15} />
            Save a file
          </button>
          <Export />
          <button type="button" class="small" onClick={() => openDraft("")}>
            Clear
          </button>
        </>
      )}
    </section>
  );
}

function FilePicker() {
  const input = useRef<HTMLInputElement>(null);
  return (
    <>
      <button type="button" class="small" onClick={() => input.current?.click()}>
        <Icon name="file" size={15} />
        Open a file
      </button>
      <input ref={input} type="file" accept=".json,.plan,.waypoints,.txt,application/json" hidden onChange={(event) => { void openFile(event.currentTarget.files?.[0]); event.currentTarget.value = ""; }} />
    </>
  );
}

/** The service writes only what it has: a draft is stored first. */
function Export() {
  const off = !isStored.value || !live.value;
  return (
    <select class="small" aria-label="Export the stored plan" title={off ? "Store the plan first" : undefined} disabled={off} value="" onChange={(event) => { void exportPlan(event.currentTarget.value as TargetFormat); event.currentTarget.value = ""; }}>
      <option value="">{off ? "Export once stored" : "Export…"}</option>
      <option value="qgc">QGroundControl .plan</option>
      <option value="geojson">GeoJSON</option>
      <option value="kml">KML</option>
    </select>
  );
}

function StoredPlans() {
  const plans = storedPlans.value ?? [];
  if (plans.length === 0) return null;
  return (
    <select class="small" aria-label="Open a stored plan" value="" onFocus={() => void readStoredPlans()} onChange={(event) => { void openStored(event.currentTarget.value); event.currentTarget.value = ""; }}>
      <option value="">Stored plans ({plans.length})</option>
      {plans.map((plan) => (
        <option key={plan.id} value={plan.id} title={fullTime(plan.created_at)}>
          {plan.name}
        </option>
      ))}
    </select>
  );
}
