import { useEffect } from "preact/hooks";
import type { TaskQueue } from "../../api/types";
import { formatReason } from "../../format/reasons";
import { toSentence } from "../../format/text";
import { Badge } from "../../ui/badge";
import { HoldButton, TransientButton } from "../../ui/buttons";
import { controlMethod, tasksOnly } from "../offboard/capabilities";
import { controlledRun, engaged, manualControl } from "../offboard/control-state";
import { lookAwayHint } from "../offboard/labels";
import { RefusalNote } from "../offboard/refusal";
import { afterLastHint, queueStateLabel, queueStateTone } from "./labels";
import { ownsQueue, taskQueue } from "./queue";
import { nextTask, queueAction, taskRefusal } from "./task-draft";
import { TaskForm } from "./task-form";
import { TaskList } from "./task-list";

/** The task queue: to be changed with the lease, to be looked at without. */
export function TasksSection({ vehicle }: { vehicle: string }) {
  const queue = taskQueue.value;
  const own = ownsQueue.value;
  useEffect(
    () => () => {
      taskRefusal.value = null;
    },
    [vehicle],
  );
  const refusal = taskRefusal.value; // without the lease: it was lost meanwhile
  if (!own && queue === null && refusal === null) return null;
  return (
    <section class="tasks" aria-labelledby="tasks-title" data-state={queue?.report.state ?? "idle"}>
      <h4 id="tasks-title">
        Tasks of {vehicle}
        {queue !== null && (
          <span role="status">
            <Badge tone={queueStateTone(queue.report)}>{queueStateLabel(queue.report)}</Badge>
          </span>
        )}
      </h4>
      {queue?.report.state === "paused" && queue.report.reason !== null && (
        <p class="tasks-reason">{toSentence(formatReason(queue.report.reason))}</p>
      )}
      {queue !== null && queue.tasks.length > 0 && <TaskList queue={queue} vehicle={vehicle} own={own} />}
      {queue !== null && queue.report.state !== "idle" && (
        <p class="hint after-last">
          {afterLastHint(queue.when_empty, vehicle, controlledRun.value !== null, tasksOnly.value)}
        </p>
      )}
      {own && queue !== null && <QueueActions queue={queue} vehicle={vehicle} />}
      {refusal !== null && <RefusalNote refusal={refusal} />}
      {own && <TaskForm vehicle={vehicle} />}
      {own && tasksOnly.value && engaged.value && controlMethod.value !== null && (
        <p class="hint">{lookAwayHint(vehicle, controlMethod.value)}</p>
      )}
      {own && manualControl.value.source === "tasks" && !tasksOnly.value && (
        <p class="hint">{lookAwayHint(vehicle, "setpoints")} The controls and a gamepad take over at once.</p>
      )}
    </section>
  );
}

/** Actions of the whole queue. Under manual control it waits until the pilot resumes it. */
function QueueActions({ queue, vehicle }: { queue: TaskQueue; vehicle: string }) {
  const { state } = queue.report;
  const current = queue.tasks[0];
  const empty = current === undefined;
  const stands = state === "paused" || state === "manual";
  if (empty && !stands) return null;
  return (
    <div class="actions queue-actions" role="group" aria-label="Queue">
      {stands ? (
        <TransientButton
          name={state === "manual" ? "Fly the tasks" : "Resume"}
          onClick={() => void queueAction("resume", "Fly the tasks")}
        />
      ) : (
        <TransientButton name="Pause" onClick={() => void queueAction("pause", "Pause")} />
      )}
      {!empty && <TransientButton name="Next task" onClick={() => void nextTask(current.id)} />}
      {!empty && (
        <HoldButton
          verb="Clear tasks of"
          vehicle={vehicle}
          tone="warn"
          onConfirm={() => void queueAction("clear", "Clear the tasks")}
        />
      )}
    </div>
  );
}
