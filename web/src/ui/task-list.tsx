import { useLayoutEffect, useRef } from "preact/hooks";
import type { TaskQueue } from "../api/types";
import { manualControl } from "../state/hands-on";
import { moveTask } from "../state/task-draft";
import { mayBeMended } from "../tasks/mend";
import { TaskRow } from "./task-row";

/** The queue, current task first. With the lease its order is changed by dragging, or by the buttons of each task. */
export function TaskList({ queue, vehicle, own }: { queue: TaskQueue; vehicle: string; own: boolean }) {
  const list = useRef<HTMLOListElement>(null);
  const pressed = useRef("");
  useLayoutEffect(() => {
    if (pressed.current === "" || document.activeElement !== document.body) return;
    list.current?.querySelector<HTMLElement>(pressed.current)?.focus(); // it was moved with its task, and lost the focus
  });
  const ids = queue.tasks.map(({ id }) => id);
  const isLeasedOnly = manualControl.value.phase === "leased";
  return (
    <ol class="task-list" aria-label="Queue, current task first" ref={list}>
      {queue.tasks.map((entry, i) => (
        <TaskRow
          key={entry.id}
          entry={entry}
          place={i}
          behind={ids.length - 1 - i}
          vehicle={vehicle}
          remaining_s={i === 0 ? queue.report.remaining_s : null}
          may={own ? { mend: mayBeMended(queue.tasks, entry.id, isLeasedOnly), up: i > 0, down: i < ids.length - 1 } : null}
          onMove={(by) => move(entry.id, ids[i + by], by < 0 ? ".up" : ".down")}
        />
      ))}
    </ol>
  );

  function move(id: string, onto: string | undefined, button: string): void {
    pressed.current = `[data-task="${id}"] ${button}`;
    if (onto !== undefined) void moveTask(id, onto);
  }
}
