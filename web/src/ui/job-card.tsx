import type { Job, JobCandidate } from "../api/types";
import { candidateWords, jobStateName, jobStateTone, startWords, vehicleWords } from "../format/job-words";
import { reasonWords } from "../format/reasons";
import { fullSentence } from "../format/words";
import { isCancellable } from "../jobs/lists";
import { cancelJob, candidatesNow, jobsNow, openedJob, openRunOf } from "../state/jobs";
import { may } from "../state/principal";
import { live } from "../state/store";
import { Badge } from "./badge";
import { HoldButton } from "./hold-button";

/** One job; opened, each vehicle with what speaks for or against it, and the way to cancel. */
export function JobCard({ job }: { job: Job }) {
  const open = openedJob.value === job.id;
  return (
    <li class="job" data-job={job.id} data-state={job.state}>
      <button type="button" class="job-head" aria-expanded={open} onClick={() => (openedJob.value = open ? null : job.id)}>
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
          {open && isCancellable(job) && may("dispatcher") && <HoldButton verb="Cancel" vehicle={`“${job.plan_name}”`} tone="warn" disabled={!live.value} onConfirm={() => void cancelJob(job)} />}
        </div>
      )}
      {open && <Candidates job={job} />}
    </li>
  );
}

function JobFacts({ job }: { job: Job }) {
  const now = job.deadline === null && job.not_before === null ? null : jobsNow.value;
  const facts = [vehicleWords(job), ...startWords(job, now), job.order_id === null ? "" : `order ${job.order_id}`, job.requested_by === "" ? "" : `by ${job.requested_by}`];
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
      {hopeless && <p class="job-warning tone-warn" role="status">No vehicle can fly it as it is, and waiting does not change that.</p>}
      <ul class="job-candidates" aria-label={waits ? "What speaks for and against each vehicle now" : "What spoke for and against each vehicle"}>
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
      <b>{candidate.vehicle_id}</b> <Badge tone={candidate.chosen ? "ok" : can ? "info" : "warn"}>{candidate.chosen ? "Chosen" : can ? "Could" : "Cannot"}</Badge>
      {candidateWords(candidate).map((words) => (
        <p key={words}>{words}</p>
      ))}
    </li>
  );
}
