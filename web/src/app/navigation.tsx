import { hasSimulator } from "../features/simulator/simulator";
import { PANELS, type Panel, panel, showPanel, showView, VIEWS, type View, view } from "../store/selection";
import { Icon, type IconName } from "../ui/icons";

export const PANEL_LABELS: Readonly<Record<Panel, string>> = {
  plan: "Plan",
  run: "Run",
  jobs: "Jobs",
  offboard: "Manual control",
  simulator: "Simulator",
};

/**
 * Plan, run, jobs, manual control, and the simulated vehicles where there are any, beside the map. Arrow keys move
 * between the tabs.
 */
export function PanelTabs() {
  const shown = PANELS.filter((name) => name !== "simulator" || hasSimulator.value);
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
    const step = event.key === "ArrowRight" ? 1 : -1;
    const next = shown[(shown.indexOf(panel.value) + step + shown.length) % shown.length] ?? panel.value;
    showPanel(next);
    document.getElementById(`tab-${next}`)?.focus();
  };
  return (
    <div class="tabs" role="tablist" aria-label="Panels" onKeyDown={onKeyDown}>
      {shown.map((name) => (
        <button
          key={name}
          id={`tab-${name}`}
          type="button"
          role="tab"
          aria-selected={panel.value === name}
          aria-controls="panel"
          tabIndex={panel.value === name ? 0 : -1}
          onClick={() => showPanel(name)}
        >
          {PANEL_LABELS[name]}
        </button>
      ))}
    </div>
  );
}

/** Eight of them fit 360 px: one is cut short there and named in full. */
const VIEW_NAMES: Readonly<Record<View, readonly [string, IconName, string?]>> = {
  map: ["Map", "map"],
  fleet: ["Fleet", "fleet"],
  plan: ["Plan", "plan"],
  run: ["Run", "run"],
  jobs: ["Jobs", "jobs"],
  offboard: ["Control", "joystick", "Manual control"],
  simulator: ["Faults", "simulator"],
  feed: ["Events", "feed"],
};

/** The way around on a narrow page. */
export function ViewBar() {
  const shown = VIEWS.filter((name) => name !== "simulator" || hasSimulator.value);
  return (
    <nav class="view-bar" aria-label="Views">
      {shown.map((name) => (
        <button
          key={name}
          type="button"
          aria-label={VIEW_NAMES[name][2]}
          aria-current={view.value === name ? "page" : undefined}
          onClick={() => showView(name)}
        >
          <Icon name={VIEW_NAMES[name][1]} size={20} />
          {VIEW_NAMES[name][0]}
        </button>
      ))}
    </nav>
  );
}
