import { useState } from "preact/hooks";
import type { Job, JobCandidate, JobQueue } from "../../api/types";
import { formatReason } from "../../format/reasons";
import { toSentence } from "../../format/text";
import { isHeard } from "../../store/link-loss";
import { hasRole } from "../../store/principal";
import { showPanel } from "../../store/selection";
import { jobQueues, jobs, live, serviceSeconds } from "../../store/store";
import { Badge } from "../../ui/badge";
import { HoldButton } from "../../ui/buttons";
import { Icon } from "../../ui/icons";
import {
  cancelJob,
  clearJobClaim,
  expandedJob,
  jobCandidates,
  jobsLoaded,
  moveJob,
  openJobRun,
  resumeJobQueue,
} from "./jobs";
import {
  describeCandidate,
  describeJobStart,
  describeJobVehicle,
  jobStateLabel,
  jobStateTone,
  NO_VEHICLE_EVER,
} from "./labels";
import { groupJobs, isCancellable, isClaimClearable, isReadyToStart, stoppedQueues } from "./lists";

/** What waits for a vehicle, what has one, and what became of the last. */
export function JobsPanel() {
  const { active, waiting, over } = groupJobs(jobs.value);
  const stopped = stoppedQueues(jobQueues.value);
  if (active.length + waiting.length + over.length + stopped.length === 0) return <NoJobs />;
  const mayResume = stopped.length > 0 && hasRole("pilot");
  const toStart = mayResume ? undefined : active.find((job) => isReadyToStart(job));
  return (
    <div class="panel-body jobs">
      {stopped.map((queue, index) => (
        <StoppedQueue key={queue.vehicle_id} queue={queue} first={index === 0} />
      ))}
      <button
        type="button"
        class={mayResume || toStart !== undefined ? "small" : "primary"}
        onClick={() => showPanel("plan")}
      >
        <Icon name="plus" size={16} /> Queue another plan
      </button>
      <JobList title="Assigned" jobs={active} next={toStart} />
      <JobList title="Queue" jobs={waiting} isOrdered />
      <JobList title="Finished" jobs={over} />
    </div>
  );
}

/** Each card is drawn again every second: thousands would make the page stand still. */
const SHOWN_JOBS = 100;

interface ListProps {
  title: string;
  jobs: readonly Job[];
  /** The jobs wait in this order, which can be changed. */
  isOrdered?: boolean;
  /** The one that a person should see to now. */
  next?: Job | undefined;
}

function JobList({ title, jobs: listed, isOrdered = false, next }: ListProps) {
  const [most, setMost] = useState(SHOWN_JOBS);
  if (listed.length === 0) return null;
  const isShown = (job: Job, index: number) => index < most || job.id === expandedJob.value;
  const move = isOrdered && live.value && hasRole("dispatcher") && listed.length > 1;
  return (
    <section aria-label={title}>
      <h3>
        {title} <small>{listed.length}</small>
      </h3>
      <ul class="job-list">
        {listed.map(
          (job, index) =>
            isShown(job, index) && (
              <JobCard
                key={job.id}
                job={job}
                position={move ? { waiting: listed, index } : null}
                isNext={job.id === next?.id}
              />
            ),
        )}
      </ul>
      {listed.length > most && (
        <button type="button" class="small" onClick={() => setMost(most + SHOWN_JOBS)}>
          Show more: {most} of {listed.length} are shown
        </button>
      )}
    </section>
  );
}

/** Where a job waits that can be moved. */
interface QueuePosition {
  readonly waiting: readonly Job[];
  readonly index: number;
}

/** Not a plain text, so that nothing else on the page or the desk takes it. */
const DRAGGED = "application/x-waydrop-job";

/** What lets a job be dropped onto another one, to take its position. */
function dropTarget(position: QueuePosition | null) {
  if (position === null) return {};
  return {
    onDragOver: (event: DragEvent) => event.dataTransfer?.types.includes(DRAGGED) && event.preventDefault(),
    onDrop: (event: DragEvent) => {
      const dragged = event.dataTransfer?.getData(DRAGGED) ?? "";
      const from = position.waiting.findIndex(({ id }) => id === dragged);
      if (from < 0) return;
      event.preventDefault();
      void moveJob(position.waiting, from, position.index);
    },
  };
}

function MoveButtons({ job, position: { waiting, index } }: { job: Job; position: QueuePosition }) {
  const tools = [
    ["up", -1, index === 0],
    ["down", 1, index === waiting.length - 1],
  ] as const;
  return tools.map(([way, step, disabled]) => (
    <button
      key={way}
      type="button"
      class="small"
      aria-label={`Move ${way}: “${job.plan_name}”`}
      disabled={disabled}
      onClick={() => void moveJob(waiting, index, index + step)}
    >
      <Icon name={way} size={14} /> Move {way}
    </button>
  ));
}

function StoppedQueue({ queue, first }: { queue: JobQueue; first: boolean }) {
  return (
    <section class="job-stop tone-warn" aria-label={`Stopped job queue of ${queue.vehicle_id}`}>
      <b>The job queue of {queue.vehicle_id} is stopped</b>
      <p>{toSentence(formatReason(queue.reason))}</p>
      {hasRole("pilot") ? (
        <HoldButton
          verb="Resume the jobs of"
          vehicle={queue.vehicle_id}
          tone="warn"
          primary={first}
          disabled={!live.value}
          onConfirm={() => void resumeJobQueue(queue.vehicle_id)}
        />
      ) : (
        <p>A pilot must check the vehicle and resume its queue.</p>
      )}
    </section>
  );
}

function NoJobs() {
  return (
    <div class="panel-body empty-panel">
      <Icon name="jobs" size={40} />
      <h3>{jobsLoaded.value ? "No jobs" : "Loading jobs…"}</h3>
      <p>A job is a plan that waits for a vehicle: a named one, or any that can fly it.</p>
      <button type="button" class="primary" onClick={() => showPanel("plan")}>
        Open a plan to queue it
      </button>
      <p>
        Your dispatch system adds jobs over REST, or you run <code>waydrop jobs add PLAN.json</code>.
      </p>
      <p>
        <code>POST /api/v1/jobs</code> ·{" "}
        <a href="/api/v1/docs" target="_blank" rel="noopener">
          API
        </a>
      </p>
    </div>
  );
}

/** One job; expanded, each vehicle with the reasons for or against it, and the cancel button. */
function JobCard({ job, position, isNext }: { job: Job; position: QueuePosition | null; isNext: boolean }) {
  const open = expandedJob.value === job.id;
  return (
    <li class="job" data-job={job.id} data-state={job.state} {...dropTarget(position)}>
      <button
        type="button"
        class="job-head"
        draggable={position !== null}
        onDragStart={(event) => event.dataTransfer?.setData(DRAGGED, job.id)}
        aria-expanded={open}
        onClick={() => (expandedJob.value = open ? null : job.id)}
      >
        <b class="two-lines" title={job.plan_name}>
          {job.plan_name}
        </b>
        <Badge tone={jobStateTone(job)}>{jobStateLabel(job)}</Badge>
        <JobFacts job={job} />
      </button>
      {job.reason !== null && <p class="job-reason">{toSentence(formatReason(job.reason))}</p>}
      {(job.run_id !== null || open) && (
        <div class="actions job-actions">
          {job.run_id !== null && (
            <button type="button" class={isNext ? "primary" : "small"} onClick={() => openJobRun(job)}>
              {isReadyToStart(job) ? "Open run to start" : "Open run"}
            </button>
          )}
          {open && position !== null && <MoveButtons job={job} position={position} />}
          {open && isCancellable(job) && hasRole("dispatcher") && (
            <HoldButton
              verb="Cancel"
              vehicle={`“${job.plan_name}”`}
              tone="warn"
              disabled={!live.value}
              onConfirm={() => void cancelJob(job)}
            />
          )}
        </div>
      )}
      {open && isClaimClearable(job, isConnected(job)) && <ClearClaim job={job} />}
      {open && <Candidates job={job} />}
    </li>
  );
}

function isConnected({ vehicle_id }: Job): boolean {
  return isHeard(vehicle_id ?? "");
}

function ClearClaim({ job }: { job: Job }) {
  return (
    <div class="job-claim tone-warn" role="status">
      <p>
        The gateway of {job.claim?.site} does not answer. No other vehicle gets this job, because that gateway may still
        fly it.
      </p>
      {hasRole("pilot") ? (
        <HoldButton
          verb="Clear the claim of"
          vehicle={`“${job.plan_name}”`}
          tone="warn"
          disabled={!live.value}
          onConfirm={() => void clearJobClaim(job)}
        />
      ) : (
        <p>A pilot must make sure that it does not, and clear its claim.</p>
      )}
    </div>
  );
}

function JobFacts({ job }: { job: Job }) {
  const now = job.deadline === null && job.not_before === null ? null : serviceSeconds.value;
  const facts = [
    describeJobVehicle(job),
    ...describeJobStart(job, now),
    job.order_id === null ? "" : `order ${job.order_id}`,
    job.requested_by === "" ? "" : `by ${job.requested_by}`,
  ];
  return <small>{facts.filter((fact) => fact !== "").join(" · ")}</small>;
}

function Candidates({ job }: { job: Job }) {
  const waits = job.state === "queued";
  const known = waits ? (jobCandidates.value?.job === job.id ? jobCandidates.value.candidates : null) : job.candidates;
  if (known === null) return <p class="job-reason">Checking each vehicle…</p>;
  if (known.length === 0) return waits ? <p class="job-reason">No allowed vehicle has connected yet.</p> : null;
  const hopeless = waits && jobCandidates.value !== null && jobCandidates.value.warning !== "";
  return (
    <>
      {hopeless && (
        <p class="job-warning tone-warn" role="status">
          {NO_VEHICLE_EVER} Cancel it, or change its plan.
        </p>
      )}
      <ul class="job-candidates" aria-label={waits ? "Vehicles for this job now" : "Vehicles considered"}>
        {known.map((candidate) => (
          <Candidate key={candidate.vehicle_id} candidate={candidate} />
        ))}
      </ul>
    </>
  );
}

function Candidate({ candidate }: { candidate: JobCandidate }) {
  const can = candidate.refusals.length === 0;
  return (
    <li>
      <b>{candidate.vehicle_id}</b>{" "}
      <Badge tone={candidate.chosen ? "ok" : can ? "info" : "warn"}>
        {candidate.chosen ? "Chosen" : can ? "Suitable" : "Not suitable"}
      </Badge>
      {describeCandidate(candidate).map((words) => (
        <p key={words}>{words}</p>
      ))}
    </li>
  );
}
