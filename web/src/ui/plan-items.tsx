import type { Finding, Timeline } from "../api/types";
import { itemSummary, itemTitle } from "../plan/describe";
import { isDrop, type PlanItemView } from "../plan/document";
import { arrivalText, dropText } from "../plan/timeline";
import type { Progress } from "../map/features";
import { itemId } from "../state/selection";
import { FindingNote } from "./finding-note";

interface Props {
  items: readonly PlanItemView[];
  findingsOf: (item: PlanItemView) => readonly Finding[];
  timeline: Timeline | null;
  progress: ReadonlyMap<string, Progress> | null;
}

/** The plan as a list, in flying order; each item with its prediction, its progress and what is wrong with it. */
export function PlanItems({ items, findingsOf, timeline, progress }: Props) {
  return (
    <ol class="plan-items">
      {items.map((item) => (
        <PlanItem key={item.index} item={item} findings={findingsOf(item)} timeline={timeline} progress={progress?.get(item.id) ?? null} />
      ))}
    </ol>
  );
}

interface ItemProps {
  item: PlanItemView;
  findings: readonly Finding[];
  timeline: Timeline | null;
  progress: Progress | null;
}

function PlanItem({ item, findings, timeline, progress }: ItemProps) {
  const arrival = arrivalText(timeline, item.id);
  const drop = isDrop(item) ? dropText(timeline, item.id) : "";
  const pointed = itemId.value === item.id;
  return (
    <li class={`plan-item ${progress ?? ""} ${isDrop(item) ? "is-drop" : ""}`} aria-current={progress === "current" ? "step" : undefined}>
      <button type="button" class="plan-item-main" aria-pressed={pointed} onClick={() => (itemId.value = pointed ? null : item.id)}>
        <span class="plan-item-number">{item.index + 1}</span>
        <span class="plan-item-text">
          <b>{itemTitle(item)}</b> <code>{item.id}</code>
          <small>{itemSummary(item)}</small>
          {drop !== "" && <small class="plan-item-drop">{drop}</small>}
        </span>
        {arrival !== "" && <span class="plan-item-arrival">{arrival}</span>}
      </button>
      {findings.map((finding) => (
        <FindingNote key={finding.code + finding.pointer} finding={finding} />
      ))}
    </li>
  );
}
