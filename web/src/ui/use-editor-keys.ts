import { useEffect } from "preact/hooks";
import { viewCentre } from "../map/camera";
import { redo, undo } from "../state/draft-text";
import { applyTool, chooseTool, editing, finishSketch, sketch, tool } from "../state/editor";

/** Keys of the editor: undo and redo, Escape puts the tool away, Space draws at the middle of the map, Enter closes a fence. */
export function useEditorKeys(): void {
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => {
      if (editing.value && onKey(event)) event.preventDefault();
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
  if (tool.value === null) return false;
  if (event.key === "Escape") {
    chooseTool(null);
    return true;
  }
  if (event.key === " " && target?.closest(".map-canvas")) {
    applyTool(viewCentre.value);
    return true;
  }
  if (event.key !== "Enter" || sketch.value.length === 0 || target?.closest("button, a")) return false;
  finishSketch();
  return true;
}
