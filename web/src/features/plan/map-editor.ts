/** Editing on the map: the active tool, the fence being drawn, and the handle being dragged. */

import { batch, computed, effect, signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { PlanDocument } from "../../api/types";
import { metresBetween, type Point } from "../../geo/geometry";
import { mapCentre, mapHeight_m } from "../../store/map-view";
import { itemId, panel, selectedVehicle, vehicleId } from "../../store/selection";
import { vehicleIds, vehicles } from "../../store/store";
import { draftPlan, draftView, editPlan, openDraft, planText, redo, undo } from "./draft-text";
import {
  addCircle,
  addPolygon,
  addRallyPoint,
  type FenceKind,
  insertItem,
  insertionIndex,
  newItem,
  newPlan,
} from "./edits";
import { dragHandle, type Handle, handlesOf } from "./handles";
import type { ItemType } from "./item-types";

export const TOOLS = ["waypoint", "fence", "keep-out", "fence-circle", "keep-out-circle", "rally"] as const;
export type Tool = (typeof TOOLS)[number];

export const activeTool = signal<Tool | null>(null);
/** Corners of the fence that is being drawn. */
export const sketch = signal<readonly Point[]>([]);
export const isEditing = computed(() => panel.value === "plan" && draftPlan.value !== null);

/** What can be dragged now. A vehicle's own home counts and not the plan's: that one is not in the way. */
export const handles = computed<readonly Handle[]>(() => {
  if (!isEditing.value || draftPlan.value === null) return [];
  const known = selectedVehicle.value?.state.home != null;
  return handlesOf(draftPlan.value).filter(({ role }) => role !== "home" || !known);
});

/** Corners nearer than this are one: a double click makes two. */
const SAME_CORNER_M = 0.3;
const LEAST_CORNERS = 3;
export const canFinish = computed(() => corners().length >= LEAST_CORNERS);

export function chooseTool(next: Tool | null): void {
  batch(() => {
    activeTool.value = next;
    sketch.value = [];
  });
}

/** Use the active tool at a point of the map. */
export function applyTool(at: Point): void {
  const inHand = activeTool.value;
  switch (inHand) {
    case null:
      break;
    case "waypoint":
      addItem("waypoint", at);
      break;
    case "rally":
      editPlan((plan) => addRallyPoint(plan, at));
      break;
    case "fence-circle":
    case "keep-out-circle":
      editPlan((plan) => addCircle(plan, kindOf(inHand), at, circleRadius_m()));
      chooseTool(null);
      break;
    case "fence":
    case "keep-out":
      sketch.value = [...sketch.value, at];
  }
}

/** Close the fence that is being drawn. */
export function finishSketch(): void {
  const inHand = activeTool.value;
  const ring = corners();
  if (inHand === null || ring.length < LEAST_CORNERS) return;
  editPlan((plan) => addPolygon(plan, kindOf(inHand), ring));
  chooseTool(null);
}

function corners(): readonly Point[] {
  return sketch.value.filter((at, i) => i === 0 || metresBetween(at, sketch.value[i - 1] ?? at) > SAME_CORNER_M);
}

function kindOf(inHand: Tool): FenceKind {
  return inHand.startsWith("keep-out") ? "exclusion" : "inclusion";
}

/** A good tenth of what is seen: large enough to be taken hold of. */
function circleRadius_m(): number {
  return Math.max(5, mapHeight_m.value / 9);
}

/** A new item where it belongs, and chosen, so that the next one follows it. */
export function addItem(type: ItemType, at: Point = mapCentre.value): void {
  const plan = draftPlan.value;
  if (plan === null) return;
  const chosen = draftView.value?.items.find(({ id }) => id === itemId.value)?.index ?? null;
  // a wait may be for the drop that follows
  const index = type === "delay" && chosen !== null ? chosen + 1 : insertionIndex(plan, chosen);
  const item = newItem(plan, type, index, at);
  batch(() => {
    editPlan(() => insertItem(plan, index, item));
    itemId.value = String(item["id"]);
  });
}

/** A plan for the chosen vehicle, else for the first one there is, from where it stands. */
export function startNewPlan(): void {
  const vehicle = vehicles.value[vehicleId.value ?? vehicleIds.value[0] ?? ""] ?? null;
  const stands = vehicle?.state.home ?? null;
  const home = stands && {
    latitude_deg: stands.latitude_deg,
    longitude_deg: stands.longitude_deg,
    absolute_altitude_m: stands.altitude_m,
  };
  batch(() => {
    openDraft(planText(newPlan(vehicle?.vehicle_type ?? "multicopter", home)));
    itemId.value = null;
    chooseTool("waypoint");
  });
}

let grip: { readonly plan: PlanDocument; readonly handle: Handle; readonly number: number } | null = null;
let grips = 0;

/** Whether there is such a handle to take hold of. */
export function startDrag(role: string, pointer: string): boolean {
  const handle = handles.value.find((one) => one.role === role && one.pointer === pointer);
  const plan = draftPlan.value;
  grip = handle === undefined || plan === null ? null : { plan, handle, number: ++grips };
  return grip !== null;
}

export function dragTo(at: Point): void {
  const held = grip;
  if (held !== null) editPlan(() => dragHandle(held.plan, held.handle, at), `drag ${held.number}`, true);
}

export function endDrag(): void {
  grip = null;
}

let chosenAt: { readonly index: number; readonly count: number } | null = null;

/** An item that gets another name while it is edited stays the chosen one. */
function followChosen(): void {
  const items = draftView.value?.items ?? [];
  const item = items.find(({ id }) => id === itemId.value);
  if (item !== undefined) chosenAt = { index: item.index, count: items.length };
  else if (itemId.value === null || !isEditing.value || chosenAt?.count !== items.length) chosenAt = null;
  else itemId.value = items[chosenAt.index]?.id ?? null;
}

/** The tool is put away when the plan is. */
export function watchEditor(): void {
  effect(followChosen);
  effect(() => {
    if (!isEditing.value) chooseTool(null);
  });
}

/**
 * Keys of the editor: undo and redo, Escape puts the tool away, Space draws at the middle of the map, Enter closes a
 * fence.
 */
export function useEditorKeys(): void {
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => {
      if (isEditing.value && onKey(event)) event.preventDefault();
    };
    window.addEventListener("keydown", onKeyDown);
    return () => window.removeEventListener("keydown", onKeyDown);
  }, []);
}

/** True if the key was for the editor. */
function onKey(event: KeyboardEvent): boolean {
  const target = event.target instanceof HTMLElement ? event.target : null;
  if (target?.closest("input, textarea, select")) return false; // they have their own undo and Enter
  if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z") {
    (event.shiftKey ? redo : undo)();
    return true;
  }
  if (event.ctrlKey && event.key.toLowerCase() === "y") {
    redo();
    return true;
  }
  if (activeTool.value === null) return false;
  if (event.key === "Escape") {
    chooseTool(null);
    return true;
  }
  if (event.key === " " && target?.closest(".map-canvas")) {
    applyTool(mapCentre.value);
    return true;
  }
  if (event.key !== "Enter" || sketch.value.length === 0 || target?.closest("button, a")) return false;
  finishSketch();
  return true;
}
