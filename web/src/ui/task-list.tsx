import { useLayoutEffect, useRef } from "preact/hooks";
import type { QueuedTask, TaskQueue } from "../api/types";
import { dropTask, moveTask, removeTask } from "../state/task-draft";
import { DRAGGED, draggedText } from "../tasks/dragged";
import { progressWords, taskSummary, taskTitle } from "../tasks/words";
import { Icon } from "./icons";
import { useFocusBack } from "./use-focus-back";

/** The queue, current task first. With the lease its order is changed by dragging, or by the buttons of each task. */
export function TaskList({ queue, vehicle, own }: { queue: TaskQueue; vehicle: string; own: boolean }) {
  const list = useRef<HTMLOListElement>(null);
  const pressed = useRef("");
  useLayoutEffect(() => {
    if (pressed.current === "" || document.activeElement !== document.body) return;
    list.current?.querySelector<HTMLElement>(pressed.current)?.focus(); // it was moved with its task, and lost the focus
  });
  const ids = queue.tasks.map(({ id }) => id);
  return (
    <ol class="task-list" aria-label="Queue, current task first" ref={list}>
      {queue.tasks.map((entry, i) => (
        <li key={entry.id} class={`task ${i === 0 ? "current" : ""}`} aria-current={i === 0 ? "step" : undefined} data-task={entry.id} draggable={own} {...(own ? dragging(vehicle, entry.id) : {})}>
          <span class="task-number">{i + 1}</span>
          <Description entry={entry} remaining_s={i === 0 ? queue.report.remaining_s : null} />
          {own && (
            <span class="task-tools">
              <MoveButton icon="up" name={`Move task ${i + 1} up`} off={i === 0} onPress={() => move(entry.id, ids[i - 1], ".up")} />
              <MoveButton icon="down" name={`Move task ${i + 1} down`} off={i === ids.length - 1} onPress={() => move(entry.id, ids[i + 1], ".down")} />
              <RemoveButton id={entry.id} place={i} />
            </span>
          )}
        </li>
      ))}
    </ol>
  );

  function move(id: string, onto: string | undefined, button: string): void {
    pressed.current = `[data-task="${id}"] ${button}`;
    if (onto !== undefined) void moveTask(id, onto);
  }
}

function Description({ entry, remaining_s }: { entry: QueuedTask; remaining_s: number | null }) {
  const progress = remaining_s === null ? "" : progressWords(entry, remaining_s);
  return (
    <span class="task-text">
      <b>{taskTitle(entry.task)}</b>
      <small>{taskSummary(entry.task)}</small>
      {progress !== "" && <small class="task-progress">{progress}</small>}
    </span>
  );
}

interface MoveProps {
  icon: "up" | "down";
  name: string;
  off: boolean;
  onPress: () => void;
}

/** Never really disabled: it would lose the focus at the end of the list. */
function MoveButton({ icon, name, off, onPress }: MoveProps) {
  const ref = useFocusBack();
  return (
    <button type="button" class={`icon-button ${icon}`} ref={ref} aria-label={name} title={name} aria-disabled={off} onClick={() => !off && onPress()}>
      <Icon name={icon} size={16} />
    </button>
  );
}

function RemoveButton({ id, place }: { id: string; place: number }) {
  const ref = useFocusBack();
  const name = `Remove task ${place + 1}`;
  return (
    <button type="button" class="icon-button" aria-label={name} title={name} ref={ref} onClick={() => void removeTask(id, place)}>
      <Icon name="trash" size={16} />
    </button>
  );
}

/** Dropped onto another task it takes its place. */
function dragging(vehicle: string, id: string) {
  const shows = (event: DragEvent, over: boolean) => (event.currentTarget as HTMLElement).classList.toggle("dropping", over);
  return {
    onDragStart: (event: DragEvent) => event.dataTransfer?.setData(DRAGGED, draggedText({ vehicle, task_id: id })),
    onDragOver: (event: DragEvent) => {
      if (!event.dataTransfer?.types.includes(DRAGGED)) return;
      event.preventDefault();
      shows(event, true);
    },
    onDragLeave: (event: DragEvent) => shows(event, false),
    onDrop: (event: DragEvent) => {
      shows(event, false);
      const dragged = event.dataTransfer?.getData(DRAGGED) ?? "";
      if (dragged === "") return;
      event.preventDefault();
      void dropTask(dragged, vehicle, id);
    },
  };
}
