import type { ComponentChildren } from "preact";
import type { Finding, Timeline } from "../../api/types";
import { itemId } from "../../store/selection";
import { FindingNote } from "../../ui/finding-note";
import { isDrop, type PlanItemView } from "./document";
import { formatArrival, formatPredictedDrop, itemSummary, itemTitle } from "./labels";
import type { Progress } from "./progress";

interface Props {
  items: readonly PlanItemView[];
  findingsOf: (item: PlanItemView) => readonly Finding[];
  timeline: Timeline | null;
  progress: ReadonlyMap<string, Progress> | null;
  /** What is shown under the chosen item: its editor. */
  detail?: (item: PlanItemView) => ComponentChildren;
  /** Items can be dragged to another place in the list. */
  onMove?: (from: number, to: number) => void;
}

/** The plan as a list, in flying order; each item with its prediction, its progress and what is wrong with it. */
export function PlanItems({ items, findingsOf, timeline, progress, detail, onMove }: Props) {
  return (
    <ol class="plan-items">
      {items.map((item) => (
        <PlanItem
          key={item.index}
          item={item}
          findings={findingsOf(item)}
          timeline={timeline}
          progress={progress?.get(item.id) ?? null}
          detail={detail}
          onMove={onMove}
        />
      ))}
    </ol>
  );
}

interface ItemProps {
  item: PlanItemView;
  findings: readonly Finding[];
  timeline: Timeline | null;
  progress: Progress | null;
  detail: Props["detail"] | undefined;
  onMove: Props["onMove"] | undefined;
}

/** Not a plain text, so that nothing else on the page or the desk takes it. */
const DRAGGED = "application/x-waydrop-item";

/** What lets an item be dropped onto another one, to take its place. */
function dragging(index: number, onMove: Props["onMove"] | undefined) {
  if (onMove === undefined) return {};
  return {
    onDragOver: (event: DragEvent) => event.dataTransfer?.types.includes(DRAGGED) && event.preventDefault(),
    onDrop: (event: DragEvent) => {
      const from = event.dataTransfer?.getData(DRAGGED) ?? "";
      if (from === "") return;
      event.preventDefault();
      onMove(Number(from), index);
    },
  };
}

function PlanItem({ item, findings, timeline, progress, detail, onMove }: ItemProps) {
  const arrival = formatArrival(timeline, item.id);
  const drop = isDrop(item) ? formatPredictedDrop(timeline, item.id) : "";
  const pointed = itemId.value === item.id;
  return (
    <li
      class={`plan-item ${progress ?? ""} ${isDrop(item) ? "is-drop" : ""}`}
      aria-current={progress === "current" ? "step" : undefined}
      {...dragging(item.index, onMove)}
    >
      <button
        type="button"
        class="plan-item-main"
        aria-pressed={pointed}
        draggable={onMove !== undefined}
        onDragStart={(event) => event.dataTransfer?.setData(DRAGGED, String(item.index))}
        onClick={() => (itemId.value = pointed ? null : item.id)}
      >
        <span class="plan-item-number">{item.index + 1}</span>
        <span class="plan-item-text">
          <b>{itemTitle(item)}</b> <code>{item.id}</code>
          <small>{itemSummary(item)}</small>
          {drop !== "" && <small class="plan-item-drop">{drop}</small>}
        </span>
        {arrival !== "" && (
          <span class="plan-item-arrival" title="Predicted time from the start to the end of this item">
            {arrival}
          </span>
        )}
      </button>
      {findings.map((finding) => (
        <FindingNote key={finding.code + finding.pointer} finding={finding} />
      ))}
      {pointed && detail?.(item)}
    </li>
  );
}
