import { Icon, type IconName } from "../../ui/icons";
import { canRedo, canUndo, redo, undo } from "./draft-text";
import { activeTool, canFinish, chooseTool, finishSketch, isEditing, sketch, TOOLS, type Tool } from "./map-editor";

const NAMES: Readonly<Record<Tool, readonly [string, IconName, string]>> = {
  waypoint: ["Draw waypoints", "plan", "Click to add waypoints. Drag a point to move it."],
  fence: ["Draw a fence", "fence", "Click the corners. Enter or a double click closes the fence."],
  "keep-out": ["Draw a keep-out", "keepOut", "Click the corners. Enter or a double click closes the area."],
  "fence-circle": ["Draw a circular fence", "circle", "Click the centre, then drag the edge."],
  "keep-out-circle": ["Draw a circular keep-out", "keepOutCircle", "Click the centre, then drag the edge."],
  rally: ["Add rally points", "rally", "Click where the vehicle may return instead of home."],
};

/** What can be drawn on the map while a plan is edited, and how. */
export function MapToolbar() {
  if (!isEditing.value) return null;
  const inHand = activeTool.value;
  return (
    <div class="map-edit">
      <div class="map-toolbar" role="toolbar" aria-label="Draw on the map">
        {TOOLS.map((name) => (
          <button
            key={name}
            type="button"
            class="icon-button"
            aria-label={NAMES[name][0]}
            title={NAMES[name][0]}
            aria-pressed={inHand === name}
            onClick={() => chooseTool(inHand === name ? null : name)}
          >
            <Icon name={NAMES[name][1]} />
          </button>
        ))}
        <span class="toolbar-gap" />
        <button
          type="button"
          class="icon-button"
          aria-label="Undo"
          title="Undo (Ctrl+Z)"
          disabled={!canUndo.value}
          onClick={undo}
        >
          <Icon name="undo" />
        </button>
        <button
          type="button"
          class="icon-button"
          aria-label="Redo"
          title="Redo (Ctrl+Shift+Z)"
          disabled={!canRedo.value}
          onClick={redo}
        >
          <Icon name="redo" />
        </button>
      </div>
      {inHand !== null && (
        <p class="map-hint" role="status">
          <span>{NAMES[inHand][2]}</span>
          {sketch.value.length > 0 && (
            <button type="button" class="small" disabled={!canFinish.value} onClick={finishSketch}>
              Close shape
            </button>
          )}
          <button type="button" class="small" onClick={() => chooseTool(null)}>
            Done
          </button>
        </p>
      )}
    </div>
  );
}
