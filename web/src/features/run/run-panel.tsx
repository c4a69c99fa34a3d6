import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";
import { api } from "../../api/client";
import type { Run, RunState } from "../../api/types";
import { runStateLabel, runStateTone } from "../../format/labels";
import { formatReason } from "../../format/reasons";
import { capitalize, shortId } from "../../format/text";
import { formatDuration, formatMoment, formatPercent, formatPosition } from "../../format/units";
import { unknownRun } from "../../store/chosen-run";
import { canStartTogether } from "../../store/common-start";
import { reportProblem } from "../../store/notices";
import { planName } from "../../store/plans";
import { flightDuration, hasRunEnded, newestRuns } from "../../store/runs";
import { selectedRun, selectRun, showPanel, vehicleId } from "../../store/selection";
import { runs, serviceSeconds, today } from "../../store/store";
import { Badge } from "../../ui/badge";
import { Icon } from "../../ui/icons";
import { saveFile } from "../../ui/save-file";
import { PlanItems } from "../plan/plan-items";
import { itemProgress } from "../plan/progress";
import { ConsentCard, consentRequests } from "./consent";
import { DropCard } from "./drop-card";
import { LinkLost } from "./link-lost";
import { MovingTargets } from "./moving-targets";
import { OpenRuns } from "./open-runs";
import { allowedActions, RunActions } from "./run-actions";
import { RunComparison } from "./run-comparison";
import { runPlan, runPlanView } from "./run-plan";
import { notableReason } from "./run-reason";
import { RunSkip } from "./run-skip";
import { TelemetryStrips } from "./telemetry-strips";
import { UnknownRun } from "./unknown-run";

/** `firstFlight`: what to offer to somebody who has no run yet. */
export function RunPanel({ firstFlight }: { firstFlight: ComponentChildren }) {
  return (
    <div class="panel-body run-panel">
      <OpenRuns />
      <Selected firstFlight={firstFlight} />
    </div>
  );
}

function Selected({ firstFlight }: { firstFlight: ComponentChildren }) {
  const run = selectedRun.value;
  if (unknownRun.value !== null) return <UnknownRun id={unknownRun.value} />;
  if (run === null) return <NoRun>{firstFlight}</NoRun>;
  const questions = consentRequests(run);
  return (
    <>
      <RunHead run={run} />
      <RunSteps run={run} />
      {run.state === "uploading" && <Upload value={run.upload_percent} />}
      {questions.map((question, index) => (
        <ConsentCard
          key={`${run.id} ${question.drop.plan_item_id} ${question.consent.question}`}
          question={question}
          first={index === 0 && !canStartTogether.value}
        />
      ))}
      <RunActions
        key={run.id}
        run={run}
        rallyPoints={runPlanView.value?.rallyPoints.length ?? 0}
        secondary={questions.length > 0 || canStartTogether.value}
      />
      {runPlanView.value !== null && <RunSkip key={`skip ${run.id}`} run={run} plan={runPlanView.value} />}
      {run.started_at !== null && run.ended_at === null && <TelemetryStrips vehicle={run.vehicle_id} />}
      <MovingTargets vehicle={run.vehicle_id} />
      {run.drops.length > 0 && (
        <section aria-label="Drops" class="drops">
          {run.drops.map((drop) => (
            <DropCard
              key={`${run.id} ${drop.plan_item_id}`}
              run={run.id}
              drop={drop}
              allowed_m={allowedOffset(drop.plan_item_id)}
            />
          ))}
          {hasRunEnded(run) && <DeliveryReportButton key={run.id} run={run} />}
        </section>
      )}
      {run.drops.length === 0 && hasRunEnded(run) && (
        <button type="button" class={canStartTogether.value ? "small" : "primary"} onClick={() => showPanel("plan")}>
          Open a plan
        </button>
      )}
      <RunComparison key={`comparison ${run.id}`} run={run} />
      <RunItems key={`items ${run.id}`} run={run} />
    </>
  );
}

/** How far from its point the plan lets a parcel be released. */
function allowedOffset(itemId: string): number | null {
  const limit = runPlanView.value?.items.find(({ id }) => id === itemId)?.fields["max_offset_m"];
  return typeof limit === "number" ? limit : null;
}

function NoRun({ children }: { children: ComponentChildren }) {
  return (
    <div class="panel-body empty-panel">
      <Icon name="run" size={40} />
      <h3>{vehicleId.value === null ? "No run" : `No run of ${vehicleId.value}`}</h3>
      <p>A run is one flight of one plan. Open a plan, select a vehicle and upload it.</p>
      <button type="button" class={canStartTogether.value ? "small" : "primary"} onClick={() => showPanel("plan")}>
        Open a plan
      </button>
      {children}
    </div>
  );
}

/** The name of a run; where there are others, it chooses among them. */
function RunName({ run }: { run: Run }) {
  const all = newestRuns(runs.value);
  const name = runPlan.value?.name ?? "Run";
  const title = (
    <h3 class={all.length < 2 ? "two-lines" : "visually-hidden"} title={name}>
      {name}
    </h3>
  );
  if (all.length < 2) return title;
  return (
    <>
      {title}
      <label class="run-picker">
        <span class="visually-hidden">Run</span>
        <select value={run.id} title={runTitle(run)} onChange={(event) => selectRun(event.currentTarget.value)}>
          {all.map((other) => (
            <option key={other.id} value={other.id}>
              {runTitle(other)}
            </option>
          ))}
        </select>
      </label>
    </>
  );
}

/** What must not be cut off comes first. */
function runTitle({ created_at, vehicle_id, plan_id, state }: Run): string {
  const plan = planName(plan_id) ?? `plan ${shortId(plan_id)}`;
  return [vehicle_id, runStateLabel(state), formatMoment(created_at, today.value), plan].join(" · ");
}

/** In a component of its own, because it changes each second. */
function FlightDuration({ run }: { run: Run }) {
  const duration_s = flightDuration(run, run.ended_at === null ? serviceSeconds.value : null);
  if (duration_s === null) return null;
  const words = formatDuration(Math.round(duration_s));
  return <> · {run.ended_at === null ? `in flight for ${words}` : `flight time ${words}`}</>;
}

function RunHead({ run }: { run: Run }) {
  const reason = notableReason(run);
  return (
    <header class="run-head" data-run={run.id} data-state={run.state}>
      <div>
        <RunName run={run} />
        <Badge tone={runStateTone(run.state)}>{runStateLabel(run.state)}</Badge>
      </div>
      <small>
        {run.vehicle_id} · created {formatMoment(run.created_at, today.value)}
        <FlightDuration run={run} />
      </small>
      {reason !== null && <p class="run-reason">{capitalize(formatReason(reason))}</p>}
      {!hasRunEnded(run) && <LinkLost vehicle={run.vehicle_id} />}
      {isToBeFetched(run) && run.last_position !== null && <LastPosition heard={run.last_position} />}
      <RunContinuation run={run} />
      {run.rally !== null && <p class="run-rally">{capitalize(formatReason(run.rally.reason))}</p>}
    </header>
  );
}

/** Whether the vehicle may stand where nobody planned it. */
function isToBeFetched({ state }: Run): boolean {
  return state === "aborted" || state === "failed" || state === "lost";
}

function LastPosition({ heard }: { heard: NonNullable<Run["last_position"]> }) {
  return (
    <p class="run-place">
      Last position {formatPosition(heard)}
      {heard.is_estimated && " (estimated, without a GNSS fix)"} · {formatMoment(heard.at, today.value)}
    </p>
  );
}

function Upload({ value }: { value: number | null }) {
  return (
    <div class="upload">
      <progress max={100} value={value ?? 0} aria-label="Upload" />
      <span>{formatPercent(value)}</span>
    </div>
  );
}

function RunItems({ run }: { run: Run }) {
  const plan = runPlanView.value;
  if (plan === null) return null;
  return (
    <details class="run-items" open={!hasRunEnded(run)}>
      <summary>Items of the plan</summary>
      <PlanItems
        items={plan.items}
        findingsOf={() => []}
        timeline={runPlan.value?.timeline ?? null}
        progress={itemProgress(plan, run)}
      />
    </details>
  );
}

/** Which run this one continues, and which continues it. */
function RunContinuation({ run }: { run: Run }) {
  if (run.continues === null && run.continued_by === null) return null;
  return (
    <p class="run-continuation">
      {run.continues !== null && (
        <>
          Continues <RunLink id={run.continues} />.{" "}
        </>
      )}
      {run.continued_by !== null && (
        <>
          Continued by <RunLink id={run.continued_by} />.
        </>
      )}
    </p>
  );
}

function RunLink({ id }: { id: string }) {
  return (
    <button type="button" class="run-link" onClick={() => selectRun(id)}>
      {id}
    </button>
  );
}

type Step = "Uploaded" | "Started" | "Flying" | "Landed" | "Completed";
const STEPS: readonly Step[] = ["Uploaded", "Started", "Flying", "Landed", "Completed"];

/** How many steps are done in each state. A run that ended early keeps what it had done. */
const DONE: Readonly<Record<RunState, number>> = {
  created: 0,
  uploading: 0,
  uploaded: 1,
  starting: 1,
  flying: 2,
  at_drop: 2,
  paused: 2,
  returning: 2,
  landed: 4,
  completed: 5,
  aborted: 0,
  failed: 0,
  lost: 0,
};

/** A run that ended early keeps what it had done: one that took off and was closed with a known end has landed. */
function reachedEarly(run: Run): number {
  if (run.started_at !== null) return run.state === "aborted" ? 4 : 3;
  return run.upload_percent === 100 ? 1 : 0;
}

/** The run as a row of steps: done, under way, to come. */
function RunSteps({ run }: { run: Run }) {
  const early = run.state === "aborted" || run.state === "failed" || run.state === "lost";
  const done = early ? reachedEarly(run) : DONE[run.state];
  return (
    <ol class={`steps${early ? " early" : ""}`}>
      {STEPS.map((step, index) => (
        <li
          key={step}
          class={index < done ? "done" : index === done && !early && run.state !== "uploaded" ? "current" : ""}
          aria-current={index === done && !early ? "step" : undefined}
        >
          {step}
        </li>
      ))}
    </ol>
  );
}

/** Saves the delivery report as a file: a token goes with the request, which a plain link could not carry. */
function DeliveryReportButton({ run }: { run: Run }) {
  const [busy, setBusy] = useState(false);
  const isNext = allowedActions(run).length === 0 && !canStartTogether.value;
  const save = async () => {
    setBusy(true);
    try {
      saveFile(`delivery-report-${run.id}.html`, await api.deliveryReportPage(run.id), "text/html");
    } catch (error) {
      reportProblem("Save the delivery report", error);
    } finally {
      setBusy(false);
    }
  };
  return (
    <button
      type="button"
      class={`${isNext ? "primary" : "small"} delivery-report`}
      disabled={busy}
      onClick={() => void save()}
    >
      <Icon name="file" /> Save delivery report
    </button>
  );
}
