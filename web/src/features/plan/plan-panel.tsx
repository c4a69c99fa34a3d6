import { useEffect, useRef } from "preact/hooks";
import { asSentence, vehicleTypeName } from "../../format/labels";
import { selectVehicle, vehicleId } from "../../store/selection";
import { live, vehicleIds, vehicles } from "../../store/store";
import { Badge } from "../../ui/badge";
import { FindingNote } from "../../ui/finding-note";
import { Icon } from "../../ui/icons";
import { useSteady } from "../../ui/use-steady";
import { AltitudeProfile } from "./altitude-profile";
import { itemOfFinding } from "./document";
import { canSend, check, checking, draftTimeline, findings, sending, uploadDraft } from "./draft";
import { draftView, parsed } from "./draft-text";
import { totalText } from "./labels";
import { ConversionNote, PlanSource } from "./plan-source";
import { PlanTabs } from "./plan-tabs";
import { WindFields } from "./wind";

export function PlanPanel() {
  return (
    <div class="panel-body">
      <PlanSource />
      <ConversionNote />
      <PlanProblem />
      <PlanSummary />
      {draftView.value !== null && <WindFields />}
      <PlanTabs plan={draftView.value} />
      <SendForm />
    </div>
  );
}

/** The text is no plan at all, or the service refused to look at it. */
function PlanProblem() {
  const text = parsed.value;
  if (text !== null && "error" in text) return <p class="form-problem">{text.error}</p>;
  if (check.value.kind !== "refused") return null;
  const { title, detail, hint } = check.value.problem;
  return (
    <p class="form-problem">
      {title}
      {detail !== "" && `. ${asSentence(detail)}`} {asSentence(hint)}
    </p>
  );
}

/** What holds for the plan as a whole; what is wrong with one item stands on that item. */
function PlanSummary() {
  const plan = draftView.value;
  if (plan === null) return null;
  const ofPlan = findings.value.filter((finding) => itemOfFinding(finding, plan.items) === null);
  const timeline = draftTimeline.value;
  const numberOf = (id: string) => {
    const item = plan.items.find((one) => one.id === id);
    return item === undefined ? null : item.index + 1;
  };
  return (
    <section aria-label="The plan">
      <header class="plan-head">
        <h3>{plan.name}</h3>
        <small>
          {[vehicleTypeName(plan.vehicleType), plural(plan.items.length, "item"), totalText(timeline)]
            .filter((part) => part !== "")
            .join(" · ")}
        </small>
        <Verdict />
      </header>
      {ofPlan.map((finding) => (
        <FindingNote key={finding.code + finding.pointer} finding={finding} folded={finding.severity === "warning"} />
      ))}
      <AltitudeProfile timeline={timeline} numberOf={numberOf} />
    </section>
  );
}

function Verdict() {
  const count = (severity: string) => findings.value.filter((finding) => finding.severity === severity).length;
  const [errors, warnings] = [count("error"), count("warning")];
  const depends = vehicleId.value === null && findings.value.some(({ assumed }) => assumed.length > 0);
  if (!live.value) return <Badge>Not checked: no connection</Badge>;
  if (check.value.kind === "none" || (checking.value && findings.value.length === 0 && check.value.kind !== "done"))
    return <Badge>Checking…</Badge>;
  return (
    <span class="verdict" role="status" aria-busy={checking.value}>
      {errors > 0 && <Badge tone="danger">{plural(errors, "error")}</Badge>}
      {warnings > 0 && <Badge tone="warn">{plural(warnings, "warning")}</Badge>}
      {errors === 0 &&
        check.value.kind === "done" &&
        (depends ? <Badge tone="warn">Depends on the vehicle</Badge> : <Badge tone="ok">Can be flown</Badge>)}
      {check.value.kind === "done" && check.value.parametersAgeS !== null && (
        <small>parameters {Math.round(check.value.parametersAgeS)} s old</small>
      )}
    </span>
  );
}

/** Choose the vehicle and upload. Starting is a step of its own, in the run panel. */
function SendForm() {
  const plan = draftView.value;
  const fleet = useSteady(() =>
    vehicleIds.value.map((id) => ({
      id,
      type: vehicles.value[id]?.vehicle_type ?? null,
      quarantined: vehicles.value[id]?.quarantined !== null,
    })),
  ).value;
  const suitable = fleet
    .filter(({ type, quarantined }) => !quarantined && type === (plan?.vehicleType ?? null))
    .map(({ id }) => id);
  const chosen = fleet.find(({ id }) => id === vehicleId.value)?.id ?? null;
  const first = suitable[0] ?? null;
  const suggested = useRef<string | null>(null); // ours, not the user's: another type of plan gets another one
  useEffect(() => {
    const meanwhile = vehicleId.peek(); // a choice made since this was drawn is never overruled
    const isChosen =
      meanwhile !== null &&
      meanwhile in vehicles.peek() &&
      (meanwhile !== suggested.current || suitable.includes(meanwhile));
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
          {chosen === null && <option value="">Choose…</option>}
          {fleet.map(({ id, type }) => (
            <option key={id} value={id}>
              {id} · {vehicleTypeName(type)}
            </option>
          ))}
        </select>
      </label>
      <button type="submit" class="primary" disabled={!canSend.value || chosen === null}>
        <Icon name="run" />
        {sending.value ? "Uploading…" : chosen === null ? "Upload" : `Upload to ${chosen}`}
      </button>
    </form>
  );
}

function plural(count: number, word: string): string {
  return `${count} ${word}${count === 1 ? "" : "s"}`;
}
