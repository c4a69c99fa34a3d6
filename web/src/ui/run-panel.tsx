import type { Run } from "../api/types";
import { reasonWords } from "../format/reasons";
import { clockTime, percent, seconds } from "../format/units";
import { asSentence, runStateName, runStateTone } from "../format/words";
import { itemProgress } from "../map/features";
import { viewPlan } from "../plan/document";
import { questionsOf } from "../state/consents";
import { plansById } from "../state/plans";
import { runPlan } from "../state/run-plan";
import { newestRuns } from "../state/runs";
import { selectRun, selectedRun, showPanel } from "../state/selection";
import { runs } from "../state/store";
import { Badge } from "./badge";
import { ConsentCard } from "./consent-card";
import { DropCard } from "./drop-card";
import { Icon } from "./icons";
import { MovingTargets } from "./moving-targets";
import { PlanItems } from "./plan-items";
import { DeliveryReportButton } from "./proof-button";
import { RunActions } from "./run-actions";
import { RunComparison } from "./run-comparison";
import { RunContinuation } from "./run-continuation";
import { RunSkip } from "./run-skip";
import { RunSteps } from "./run-steps";
import { TelemetryStrips } from "./telemetry-strips";

export function RunPanel() {
  const run = selectedRun.value;
  if (run === null) return <NoRun />;
  return (
    <div class="panel-body">
      <RunPicker run={run} />
      <RunHead run={run} />
      <RunSteps run={run} />
      {run.state === "uploading" && <Upload value={run.upload_percent} />}
      {questionsOf(run).map((question) => (
        <ConsentCard key={`${run.id} ${question.drop.plan_item_id} ${question.consent.question}`} question={question} />
      ))}
      <RunActions key={run.id} run={run} rallyPoints={rallyPoints(run)} />
      <SkipTo key={`skip ${run.id}`} run={run} />
      {run.started_at !== null && run.ended_at === null && <TelemetryStrips vehicle={run.vehicle_id} />}
      <MovingTargets vehicle={run.vehicle_id} />
      {run.drops.length > 0 && (
        <section aria-label="Drops" class="drops">
          {run.drops.map((drop) => (
            <DropCard key={`${run.id} ${drop.plan_item_id}`} run={run.id} drop={drop} allowed_m={allowedOffset(drop.plan_item_id)} />
          ))}
          <DeliveryReportButton key={run.id} run={run} />
        </section>
      )}
      <RunComparison key={`comparison ${run.id}`} run={run} />
      <RunItems run={run} />
    </div>
  );
}

/** How many the run's plan has; none while the plan is read. */
function rallyPoints(run: Run): number {
  const stored = plansById.value[run.plan_id];
  return stored === undefined ? 0 : viewPlan(stored.plan).rallyPoints.length;
}

/** How far from its point the plan lets a parcel be released. */
function allowedOffset(itemId: string): number | null {
  const stored = runPlan.value;
  const limit = stored === null ? null : viewPlan(stored.plan).items.find(({ id }) => id === itemId)?.fields["max_offset_m"];
  return typeof limit === "number" ? limit : null;
}

function NoRun() {
  return (
    <div class="panel-body empty-panel">
      <Icon name="run" size={40} />
      <h3>No run yet</h3>
      <p>A run is one flight of one plan. Open a plan, choose a vehicle and upload it.</p>
      <button type="button" class="primary" onClick={() => showPanel("plan")}>
        Open a plan
      </button>
    </div>
  );
}

function RunPicker({ run }: { run: Run }) {
  const all = newestRuns(runs.value);
  if (all.length < 2) return null;
  return (
    <label class="run-picker">
      <span class="visually-hidden">Run</span>
      <select value={run.id} onChange={(event) => selectRun(event.currentTarget.value)}>
        {all.map((other) => (
          <option key={other.id} value={other.id}>
            {clockTime(other.created_at)} · {other.vehicle_id} · {plansById.value[other.plan_id]?.name ?? other.plan_id} · {runStateName(other.state)}
          </option>
        ))}
      </select>
    </label>
  );
}

function RunHead({ run }: { run: Run }) {
  const took = run.started_at === null ? null : (run.ended_at ?? run.updated_at) - run.started_at;
  return (
    <header class="run-head" data-run={run.id} data-state={run.state}>
      <div>
        <h3>{runPlan.value?.name ?? "Run"}</h3>
        <Badge tone={runStateTone(run.state)}>{runStateName(run.state)}</Badge>
      </div>
      <small>
        {run.vehicle_id} · created {clockTime(run.created_at)}
        {took !== null && ` · ${run.ended_at === null ? "flying for" : "flew for"} ${seconds(Math.round(took))}`}
      </small>
      {run.reason !== null && <p class="run-reason">{asSentence(reasonWords(run.reason))}</p>}
      <RunContinuation run={run} />
      {run.rally !== null && <p class="run-rally">{asSentence(reasonWords(run.rally.reason))}</p>}
    </header>
  );
}

function Upload({ value }: { value: number | null }) {
  return (
    <div class="upload">
      <progress max={100} value={value ?? 0} aria-label="Upload" />
      <span>{percent(value)}</span>
    </div>
  );
}

function SkipTo({ run }: { run: Run }) {
  const stored = plansById.value[run.plan_id];
  return stored === undefined ? null : <RunSkip run={run} plan={viewPlan(stored.plan)} />;
}

function RunItems({ run }: { run: Run }) {
  const stored = runPlan.value;
  if (stored === null) return null;
  const plan = viewPlan(stored.plan);
  return (
    <section aria-label="Items of the plan">
      <PlanItems items={plan.items} findingsOf={() => []} timeline={stored.timeline} progress={itemProgress(plan, run)} />
    </section>
  );
}
