import type { Job, JobCandidate, JobQueue } from "../../api/types";
import { fullSentence } from "../../format/labels";
import { reasonWords } from "../../format/reasons";
import { may } from "../../store/principal";
import { jobQueues, jobs, live } from "../../store/store";
import { Badge } from "../../ui/badge";
import { HoldButton } from "../../ui/buttons";
import { Icon } from "../../ui/icons";
import { cancelJob, candidatesNow, jobsNow, jobsRead, openedJob, openRunOf, resumeQueue } from "./jobs";
import { candidateWords, jobStateName, jobStateTone, startWords, vehicleWords } from "./labels";
import { isCancellable, jobLists, stoppedQueues } from "./lists";

/** What waits for a vehicle, what has one, and what became of the last. */
export function JobsPanel() {
  const { active, waiting, over } = jobLists(jobs.value);
  const stopped = stoppedQueues(jobQueues.value);
  if (active.length + waiting.length + over.length + stopped.length === 0) return <NoJobs />;
  return (
    <div class="panel-body jobs">
      {stopped.map((queue) => (
        <StoppedQueue key={queue.vehicle_id} queue={queue} />
      ))}
      <JobList title="With a vehicle" jobs={active} />
      <JobList title="Waiting, the next one first" jobs={waiting} />
      <JobList title="Over, the newest first" jobs={over} />
    </div>
  );
}

function JobList({ title, jobs: listed }: { title: string; jobs: readonly Job[] }) {
  if (listed.length === 0) return null;
  return (
    <section aria-label={title}>
      <h3>
        {title} <small>{listed.length}</small>
      </h3>
      <ul class="job-list">
        {listed.map((job) => (
          <JobCard key={job.id} job={job} />
        ))}
      </ul>
    </section>
  );
}

function StoppedQueue({ queue }: { queue: JobQueue }) {
  return (
    <section class="job-stop tone-warn" aria-label={`The jobs of ${queue.vehicle_id} are stopped`}>
      <b>No more jobs on {queue.vehicle_id}</b>
      <p>{fullSentence(reasonWords(queue.reason))}</p>
      {may("pilot") ? (
        <HoldButton
          verb="Go on with"
          vehicle={queue.vehicle_id}
          tone="warn"
          disabled={!live.value}
          onConfirm={() => void resumeQueue(queue.vehicle_id)}
        />
      ) : (
        <p>A pilot looks at the vehicle and lets its queue go on.</p>
      )}
    </section>
  );
}

function NoJobs() {
  return (
    <div class="panel-body empty-panel">
      <Icon name="jobs" size={40} />
      <h3>{jobsRead.value ? "No jobs" : "Jobs are not known yet"}</h3>
      <p>A job is a plan that waits for a vehicle: for one that is named, or for any that can fly it.</p>
      <p>
        Your dispatch system orders them over REST, or you by <code>waydrop jobs add PLAN.json</code>. They appear here
        at once.
      </p>
      <p>
        <code>POST /api/v1/jobs</code> · <a href="/api/v1/docs">API</a>
      </p>
    </div>
  );
}

/** One job; opened, each vehicle with what speaks for or against it, and the way to cancel. */
export function JobCard({ job }: { job: Job }) {
  const open = openedJob.value === job.id;
  return (
    <li class="job" data-job={job.id} data-state={job.state}>
      <button
        type="button"
        class="job-head"
        aria-expanded={open}
        onClick={() => (openedJob.value = open ? null : job.id)}
      >
        <b>{job.plan_name}</b>
        <Badge tone={jobStateTone(job)}>{jobStateName(job)}</Badge>
        <JobFacts job={job} />
      </button>
      {job.reason !== null && <p class="job-reason">{fullSentence(reasonWords(job.reason))}</p>}
      {(job.run_id !== null || open) && (
        <div class="actions job-actions">
          {job.run_id !== null && (
            <button type="button" class="small" onClick={() => void openRunOf(job)}>
              {job.state === "prepared" && !job.auto_start ? "Open its run to start it" : "Open its run"}
            </button>
          )}
          {open && isCancellable(job) && may("dispatcher") && (
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
      {open && <Candidates job={job} />}
    </li>
  );
}

function JobFacts({ job }: { job: Job }) {
  const now = job.deadline === null && job.not_before === null ? null : jobsNow.value;
  const facts = [
    vehicleWords(job),
    ...startWords(job, now),
    job.order_id === null ? "" : `order ${job.order_id}`,
    job.requested_by === "" ? "" : `by ${job.requested_by}`,
  ];
  return <small>{facts.filter((fact) => fact !== "").join(" · ")}</small>;
}

function Candidates({ job }: { job: Job }) {
  const waits = job.state === "queued";
  const known = waits ? (candidatesNow.value?.job === job.id ? candidatesNow.value.candidates : null) : job.candidates;
  if (known === null) return <p class="job-reason">Asking what speaks against each vehicle…</p>;
  if (known.length === 0) return waits ? <p class="job-reason">No vehicle has been seen that it may have.</p> : null;
  const hopeless = waits && candidatesNow.value !== null && candidatesNow.value.warning !== "";
  return (
    <>
      {hopeless && (
        <p class="job-warning tone-warn" role="status">
          No vehicle can fly it as it is, and waiting does not change that.
        </p>
      )}
      <ul
        class="job-candidates"
        aria-label={waits ? "What speaks for and against each vehicle now" : "What spoke for and against each vehicle"}
      >
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
        {candidate.chosen ? "Chosen" : can ? "Could" : "Cannot"}
      </Badge>
      {candidateWords(candidate).map((words) => (
        <p key={words}>{words}</p>
      ))}
    </li>
  );
}
