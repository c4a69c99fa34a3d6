import { useEffect, useState } from "preact/hooks";
import { api } from "../../api/client";
import type { Comparison, DropComparison, ItemComparison, Run } from "../../api/types";
import type { Tone } from "../../format/labels";
import { formatReason, isSameReason } from "../../format/reasons";
import { capitalize } from "../../format/text";
import { formatDistance, formatDuration, formatSpeed, UNKNOWN_VALUE } from "../../format/units";

/** Predicted against flown: read again whenever an item more was flown, and once more at the end. */
export function RunComparison({ run }: { run: Run }) {
  const [comparison, setComparison] = useState<Comparison | null>(null);
  const flown = run.flown_item_ids?.length ?? 0;
  const isOver = run.ended_at !== null;
  useEffect(() => {
    if (run.started_at === null) return;
    let isWanted = true;
    const show = (read: Comparison) => isWanted && setComparison(read);
    void api.comparison(run.id).then(show, () => undefined); // the table is an extra: what was read before stays
    return () => {
      isWanted = false;
    };
  }, [run.id, run.started_at === null, flown, isOver]);
  if (comparison === null || comparison.items.length === 0) return null;
  return (
    <details class="comparison" open={isOver}>
      <summary>Predicted and actual</summary>
      <table>
        <thead>
          <tr>
            <th scope="col">Item</th>
            <th scope="col">Predicted</th>
            <th scope="col">Actual</th>
            <th scope="col">Difference</th>
          </tr>
        </thead>
        <tbody>
          {comparison.items.map((item) => (
            <Row key={visitLabel(item)} item={item} />
          ))}
        </tbody>
        <tfoot>
          <tr class={formatPause(comparison.paused_s) === "" ? "" : "explained"}>
            <th scope="row" title="All items that were flown">
              Total
            </th>
            <td>{formatDuration(comparison.predicted_s)}</td>
            <td>{formatDuration(comparison.flown_s)}</td>
            <td />
          </tr>
          <Paused seconds={comparison.paused_s} />
        </tfoot>
      </table>
      {comparison.drops
        .filter((drop) => !isExplained(drop, comparison.items))
        .map((drop) => (
          <Release key={drop.item_id} drop={drop} />
        ))}
    </details>
  );
}

/** A sentence has a line of its own below the figures: in a column it would leave no room for the names. */
function Row({ item }: { item: ItemComparison }) {
  if (needsOwnLine(item)) {
    return (
      <>
        <tr class="explained">
          <th scope="row">{visitLabel(item)}</th>
          <td>{formatDuration(item.predicted_s)}</td>
          <td>{UNKNOWN_VALUE}</td>
          <td />
        </tr>
        <tr>
          <td class="why" colSpan={4}>
            {capitalize(formatReason(item.reason))}
          </td>
        </tr>
      </>
    );
  }
  return (
    <>
      <tr class={formatPause(item.paused_s) === "" ? "" : "explained"}>
        <th scope="row">{visitLabel(item)}</th>
        <td>{formatDuration(item.predicted_s)}</td>
        <td>
          {item.flown_s === null ? (
            <span title={capitalize(formatReason(item.reason))}>{UNKNOWN_VALUE}</span>
          ) : (
            formatDuration(item.flown_s)
          )}
        </td>
        <td class={`tone-${differenceTone(item)}`}>{formatDifference(item)}</td>
      </tr>
      <Paused seconds={item.paused_s} />
    </>
  );
}

/** Below the figures that do not count it. */
function Paused({ seconds: paused_s }: { seconds: number }) {
  const words = formatPause(paused_s);
  if (words === "") return null;
  return (
    <tr>
      <td class="why" colSpan={4}>
        {words}
      </td>
    </tr>
  );
}

function Release({ drop }: { drop: DropComparison }) {
  const parts = [
    drop.distance_m === null
      ? capitalize(formatReason(drop.reason))
      : `${formatDistance(drop.distance_m)} from the predicted point`,
    drop.flown_offset_m === null
      ? ""
      : `${formatDistance(drop.flown_offset_m)} from the point (predicted ${formatDistance(drop.predicted_offset_m)})`,
    drop.flown_ground_speed_m_s === null
      ? ""
      : `at ${formatSpeed(drop.flown_ground_speed_m_s)} (predicted ${formatSpeed(drop.predicted_ground_speed_m_s)})`,
  ];
  return (
    <p>
      <b>{drop.item_id}</b> {parts.filter((part) => part !== "").join(" · ")}
    </p>
  );
}

// Predicted against flown in words. Pure.

const PROMISED_PERCENT = 15;
const RESOLVED_S = 1; // a link shows the current item once a second

export function visitLabel(item: ItemComparison): string {
  return item.visit === 1 ? item.item_id : `${item.item_id} (visit ${item.visit})`;
}

/** A difference that a link cannot show is none. */
export function formatDifference(item: ItemComparison): string {
  if (item.flown_s === null) return formatReason(item.reason);
  if (item.difference_percent === null) return "";
  const rounded = Math.round(item.difference_percent);
  const unsure = item.uncertainty_s > 0 ? ` ± ${Math.round(item.uncertainty_s)} s` : "";
  return `${rounded > 0 ? "+" : ""}${rounded} %${unsure}`;
}

/** A pause long enough to show; empty: none. Times exclude it. */
export function formatPause(paused_s: number): string {
  return paused_s < RESOLVED_S / 2 ? "" : `Paused for ${formatDuration(Math.round(paused_s))}, not counted.`;
}

/** Whether an item was not flown, for a reason that needs a line of its own. */
export function needsOwnLine(item: ItemComparison): boolean {
  return item.flown_s === null && item.reason !== null && item.reason.code !== "comparison.not_flown_yet";
}

/** Whether the table says already why there is nothing to compare of a drop. */
export function isExplained(drop: DropComparison, items: readonly ItemComparison[]): boolean {
  return (
    drop.distance_m === null &&
    items.some((item) => item.item_id === drop.item_id && needsOwnLine(item) && isSameReason(item.reason, drop.reason))
  );
}

export function differenceTone(item: ItemComparison): Tone {
  if (item.flown_s === null || item.predicted_s === null) return "neutral";
  const allowed_s = Math.max((item.flown_s * PROMISED_PERCENT) / 100, RESOLVED_S) + item.uncertainty_s;
  return Math.abs(item.flown_s - item.predicted_s) <= allowed_s ? "ok" : "warn";
}
