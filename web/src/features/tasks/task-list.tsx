import { useLayoutEffect, useRef, useState } from "preact/hooks";
import type { QueuedTask, TaskQueue } from "../../api/types";
import { toSentence } from "../../format/text";
import { secondsSince } from "../../store/clock";
import { useReturnFocus } from "../../ui/buttons";
import { Icon, type IconName } from "../../ui/icons";
import { manualControl } from "../offboard/control-state";
import { sightingIn, targetReports } from "../targets/reports";
import { type Followed, followedTasks } from "./followed-tasks";
import { describeReportAge, endlessHint, formatProgress, taskSummary, taskTitle } from "./labels";
import { encodeDrag, TASK_DRAG_TYPE } from "./order";
import { dropTaskOnto, moveTask, removeTask } from "./task-draft";
import { canEditTask, TaskEdit } from "./task-edit";

/** The queue, current task first. With the lease its order is changed by dragging, or by the buttons of each task. */
export function TaskList({ queue, vehicle, own }: { queue: TaskQueue; vehicle: string; own: boolean }) {
  const list = useRef<HTMLOListElement>(null);
  const pressed = useRef("");
  useLayoutEffect(() => {
    if (pressed.current === "" || document.activeElement !== document.body) return;
    // it was moved with its task, and lost the focus
    list.current?.querySelector<HTMLElement>(pressed.current)?.focus();
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
          may={
            own ? { edit: canEditTask(queue.tasks, entry.id, isLeasedOnly), up: i > 0, down: i < ids.length - 1 } : null
          }
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

interface Props {
  entry: QueuedTask;
  place: number;
  /** How many tasks come after it. */
  behind: number;
  vehicle: string;
  /** Of the current task; else null. */
  remaining_s: number | null;
  /** This page may change the queue, and this task; null: it has no lease. */
  may: { readonly edit: boolean; readonly up: boolean; readonly down: boolean } | null;
  onMove: (by: -1 | 1) => void;
}

/** One task of the queue. With the lease: dragged to another place, moved, edited while it waits, removed. */
function TaskRow({ entry, place, behind, vehicle, remaining_s, may, onMove }: Props) {
  const [open, setOpen] = useState(false);
  const row = useRef<HTMLLIElement>(null);
  const closed = useRef(false);
  useLayoutEffect(() => {
    if (closed.current) row.current?.querySelector<HTMLElement>(".edit")?.focus();
    closed.current = false;
  });
  const editing = open && may !== null;
  const drags = may !== null && !editing; // text in a field is chosen by dragging too
  const close = () => {
    closed.current = row.current?.contains(document.activeElement) === true;
    setOpen(false);
  };
  return (
    <li
      class={`task ${place === 0 ? "current" : ""}`}
      ref={row}
      aria-current={place === 0 ? "step" : undefined}
      data-task={entry.id}
      draggable={drags}
      {...(may !== null ? dragging(vehicle, entry.id) : {})}
    >
      <span class="task-number">{place + 1}</span>
      <Description entry={entry} behind={behind} remaining_s={remaining_s} />
      {may !== null && (
        <span class="task-tools">
          {(may.edit || editing) && (
            <ToolButton
              icon="edit"
              look="edit"
              name={`Edit task ${place + 1}`}
              open={editing}
              onPress={() => (editing ? close() : setOpen(true))}
            />
          )}
          <ToolButton icon="up" look="up" name={`Move task ${place + 1} up`} off={!may.up} onPress={() => onMove(-1)} />
          <ToolButton
            icon="down"
            look="down"
            name={`Move task ${place + 1} down`}
            off={!may.down}
            onPress={() => onMove(1)}
          />
          <ToolButton icon="trash" name={`Remove task ${place + 1}`} onPress={() => void removeTask(entry.id, place)} />
        </span>
      )}
      {editing && <TaskEdit entry={entry} place={place} onClose={close} />}
    </li>
  );
}

function Description({
  entry,
  behind,
  remaining_s,
}: {
  entry: QueuedTask;
  behind: number;
  remaining_s: number | null;
}) {
  const endless = endlessHint(entry.task, behind);
  const progress = remaining_s === null ? "" : formatProgress(entry, remaining_s);
  const followed = followedTasks.value.get(entry.id);
  return (
    <span class="task-text">
      <b>{taskTitle(entry.task, followed?.feed)}</b>
      <small>{taskSummary(entry.task, followed?.feed)}</small>
      {endless !== "" && <small class={behind > 0 ? "task-stands" : ""}>{endless}</small>}
      {followed !== undefined && <FollowedLine {...followed} />}
      {progress !== "" && <small class="task-progress">{progress}</small>}
    </span>
  );
}

/** How old the last report of its target is, or why there is none. */
function FollowedLine({ feed, refusal }: Followed) {
  const read = targetReports.value;
  if (refusal !== null)
    return (
      <small class="task-stands">
        {feed} is not followed: {toSentence(refusal.detail)}
      </small>
    );
  if (read === null) return null;
  const seen = sightingIn(read, feed, secondsSince(read.at));
  return <small class={seen.stale || seen.target === null ? "task-stands" : ""}>{describeReportAge(feed, seen)}</small>;
}

interface ToolProps {
  icon: IconName;
  name: string;
  look?: string;
  /** Never really disabled: it would lose the focus at the end of the list. */
  off?: boolean;
  open?: boolean | undefined;
  onPress: () => void;
}

function ToolButton({ icon, name, look = "", off = false, open, onPress }: ToolProps) {
  const ref = useReturnFocus<HTMLButtonElement>();
  return (
    <button
      type="button"
      class={`icon-button ${look}`}
      ref={ref}
      aria-label={name}
      title={name}
      aria-expanded={open}
      aria-disabled={off || undefined}
      onClick={() => !off && onPress()}
    >
      <Icon name={icon} size={16} />
    </button>
  );
}

/** Dropped onto another task it takes its place. */
function dragging(vehicle: string, id: string) {
  const shows = (event: DragEvent, over: boolean) =>
    (event.currentTarget as HTMLElement).classList.toggle("dropping", over);
  return {
    onDragStart: (event: DragEvent) =>
      event.dataTransfer?.setData(TASK_DRAG_TYPE, encodeDrag({ vehicle, task_id: id })),
    onDragOver: (event: DragEvent) => {
      if (!event.dataTransfer?.types.includes(TASK_DRAG_TYPE)) return;
      event.preventDefault();
      shows(event, true);
    },
    onDragLeave: (event: DragEvent) => shows(event, false),
    onDrop: (event: DragEvent) => {
      shows(event, false);
      const dragged = event.dataTransfer?.getData(TASK_DRAG_TYPE) ?? "";
      if (dragged === "") return;
      event.preventDefault();
      void dropTaskOnto(dragged, vehicle, id);
    },
  };
}
