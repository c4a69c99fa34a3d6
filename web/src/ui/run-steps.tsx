import type { Run, RunState } from "../api/types";

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
export function RunSteps({ run }: { run: Run }) {
  const early = run.state === "aborted" || run.state === "failed" || run.state === "lost";
  const done = early ? reachedEarly(run) : DONE[run.state];
  return (
    <ol class={`steps${early ? " early" : ""}`}>
      {STEPS.map((step, index) => (
        <li key={step} class={index < done ? "done" : index === done && !early && run.state !== "uploaded" ? "current" : ""} aria-current={index === done && !early ? "step" : undefined}>
          {step}
        </li>
      ))}
    </ol>
  );
}
