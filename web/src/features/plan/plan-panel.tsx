import { computed } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { vehicleTypeLabel } from "../../format/labels";
import { capitalize } from "../../format/text";
import { formatMoment } from "../../format/units";
import { isHeard } from "../../store/link-loss";
import { planName } from "../../store/plans";
import { currentRun } from "../../store/runs";
import { selectVehicle, vehicleId } from "../../store/selection";
import { live, runs, today, vehicleIds, vehicles } from "../../store/store";
import { Badge } from "../../ui/badge";
import { FindingNote } from "../../ui/finding-note";
import { Icon } from "../../ui/icons";
import { useStableComputed } from "../../ui/use-stable-computed";
import { AltitudeProfile } from "./altitude-profile";
import { findingItem } from "./document";
import { canSend, checkingPlan, draftTimeline, findings, planCheck, sendingPlan, uploadDraft } from "./draft";
import { draftView, parsedDraft } from "./draft-text";
import { describeUploadObstacle, formatTotal } from "./labels";
import { libraryShown } from "./library";
import { PlanLibrary } from "./plan-library";
import { ConversionNote, PlanSource } from "./plan-source";
import { PlanTabs, showFirstError } from "./plan-tabs";
import { WindFields } from "./wind";

/** `queue`: the form that makes a job of the plan. */
export function PlanPanel({ queue }: { queue: ComponentChildren }) {
  return (
    <div class="panel-body">
      <PlanSource />
      {libraryShown.value && <PlanLibrary />}
      <ConversionNote />
      <PlanProblem />
      <PlanSummary />
      {draftView.value !== null && <WindFields />}
      <PlanTabs plan={draftView.value} />
      {draftView.value !== null && queue}
      <SendForm />
    </div>
  );
}

/** The text is no plan at all, or the service refused to look at it. */
function PlanProblem() {
  const text = parsedDraft.value;
  if (text !== null && "error" in text) return <p class="form-problem">{text.error}</p>;
  if (planCheck.value.kind !== "refused") return null;
  const { title, detail, hint } = planCheck.value.problem;
  return (
    <p class="form-problem">
      {title}
      {detail !== "" && `. ${capitalize(detail)}`} {capitalize(hint)}
    </p>
  );
}

/** What holds for the plan as a whole; what is wrong with one item stands on that item. */
function PlanSummary() {
  const plan = draftView.value;
  if (plan === null) return null;
  const ofPlan = findings.value
    .filter((finding) => findingItem(finding, plan.items) === null)
    .sort((a, b) => Number(b.severity === "error") - Number(a.severity === "error"));
  const timeline = draftTimeline.value;
  const numberOf = (id: string) => {
    const item = plan.items.find((one) => one.id === id);
    return item === undefined ? null : item.index + 1;
  };
  return (
    <section aria-label="The plan">
      <header class="plan-head">
        <h3 class="two-lines" title={plan.name}>
          {plan.name}
        </h3>
        <small>
          {[vehicleTypeLabel(plan.vehicleType), plural(plan.items.length, "item"), formatTotal(timeline)]
            .filter((part) => part !== "")
            .join(" · ")}
        </small>
        <CheckResult />
      </header>
      {ofPlan.map((finding) => (
        <FindingNote key={finding.code + finding.pointer} finding={finding} folded={finding.severity === "warning"} />
      ))}
      <AltitudeProfile timeline={timeline} numberOf={numberOf} />
    </section>
  );
}

function CheckResult() {
  const count = (severity: string) => findings.value.filter((finding) => finding.severity === severity).length;
  const [errors, warnings] = [count("error"), count("warning")];
  const depends = vehicleId.value === null && findings.value.some(({ assumed }) => assumed.length > 0);
  if (!live.value) return <Badge>Not checked: no connection</Badge>;
  if (
    planCheck.value.kind === "none" ||
    (checkingPlan.value && findings.value.length === 0 && planCheck.value.kind !== "done")
  )
    return <Badge>Checking…</Badge>;
  return (
    <span class="check-result" role="status" aria-busy={checkingPlan.value}>
      {errors > 0 && <Badge tone="danger">{plural(errors, "error")}</Badge>}
      {warnings > 0 && <Badge tone="warn">{plural(warnings, "warning")}</Badge>}
      {errors === 0 &&
        planCheck.value.kind === "done" &&
        (depends ? <Badge tone="warn">Depends on the vehicle</Badge> : <Badge tone="ok">Can be flown</Badge>)}
      {planCheck.value.kind === "done" && planCheck.value.parametersReadAt !== null && (
        <small>parameters read at {formatMoment(planCheck.value.parametersReadAt, today.value)}</small>
      )}
    </span>
  );
}

const errorCount = computed(() => findings.value.filter(({ severity }) => severity === "error").length);

/** Choose the vehicle and upload. Starting is a step of its own, in the run panel. */
function SendForm() {
  const plan = draftView.value;
  const fleet = useStableComputed(() =>
    vehicleIds.value.map((id) => ({
      id,
      type: vehicles.value[id]?.vehicle_type ?? null,
      quarantined: vehicles.value[id]?.quarantined !== null,
    })),
  ).value;
  const obstacle = useStableComputed(uploadObstacle).value;
  const suitable = fleet
    .filter(({ type, quarantined }) => !quarantined && type === (plan?.vehicleType ?? null))
    .map(({ id }) => id);
  const chosen = fleet.find(({ id }) => id === vehicleId.value)?.id ?? null;
  const first = suitable[0] ?? null;
  const suggested = useRef<string | null>(null); // ours, not the user's: another type of plan gets another one
  useEffect(() => {
    const meanwhile = vehicleId.peek(); // a choice made since this was drawn is never overruled
    const isChosen = meanwhile !== null && (meanwhile !== suggested.current || suitable.includes(meanwhile));
    if (plan !== null && !isChosen && first !== null) {
      suggested.current = first;
      selectVehicle(first);
    }
  }, [plan?.vehicleType, chosen, first]);
  if (plan === null) return null;
  return (
    <form
      class="send"
      onSubmit={(event) => {
        event.preventDefault();
        if (chosen !== null) void uploadDraft(chosen);
      }}
    >
      <label>
        Vehicle
        <select value={chosen ?? ""} onChange={(event) => selectVehicle(event.currentTarget.value)}>
          {chosen === null && <option value="">Select…</option>}
          {fleet.map(({ id, type }) => (
            <option key={id} value={id}>
              {id} · {vehicleTypeLabel(type)}
            </option>
          ))}
        </select>
      </label>
      {obstacle !== null && <UploadObstacle {...obstacle} />}
      <button type="submit" class="primary" disabled={!canSend.value || chosen === null || obstacle !== null}>
        <Icon name="up" />
        {sendingPlan.value ? "Uploading…" : chosen === null ? "Upload" : `Upload to ${chosen}`}
      </button>
    </form>
  );
}

/** For the chosen vehicle; null: none. A run that it has is no failure. */
function uploadObstacle(): { readonly text: string; readonly isFailure: boolean } | null {
  const id = vehicleId.value;
  const run = id === null ? null : currentRun(vehicles.value[id] ?? { id, run_id: null }, runs.value);
  const heard = id === null ? null : { id, connected: isHeard(id) };
  const errors = errorCount.value;
  const text = describeUploadObstacle(errors, heard, run, run === null ? null : planName(run.plan_id));
  return text === null ? null : { text, isFailure: errors > 0 || heard?.connected === false };
}

/** Above the button, because errors may be out of sight, and what is on the map may not be what the vehicle has. */
function UploadObstacle({ text, isFailure }: { text: string; isFailure: boolean }) {
  return (
    <p class={isFailure ? "obstacle tone-danger" : "obstacle hint"}>
      {text}
      {errorCount.value > 0 && (
        <button type="button" class="small" onClick={showFirstError}>
          Show the first
        </button>
      )}
    </p>
  );
}

function plural(count: number, word: string): string {
  return `${count} ${word}${count === 1 ? "" : "s"}`;
}
