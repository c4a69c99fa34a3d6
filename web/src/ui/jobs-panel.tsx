import type { Job, JobQueue } from "../api/types";
import { reasonWords } from "../format/reasons";
import { fullSentence } from "../format/words";
import { jobLists, stoppedQueues } from "../jobs/lists";
import { jobsRead, resumeQueue } from "../state/jobs";
import { may } from "../state/principal";
import { jobQueues, jobs, live } from "../state/store";
import { HoldButton } from "./hold-button";
import { Icon } from "./icons";
import { JobCard } from "./job-card";

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
        <HoldButton verb="Go on with" vehicle={queue.vehicle_id} tone="warn" disabled={!live.value} onConfirm={() => void resumeQueue(queue.vehicle_id)} />
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
        Your dispatch system orders them over REST, or you by <code>waydrop jobs add PLAN.json</code>. They appear here at once.
      </p>
      <p>
        <code>POST /api/v1/jobs</code> · <a href="/api/v1/docs">API</a>
      </p>
    </div>
  );
}
