import { PANELS, panel, showPanel, showView, view, type Panel, type View } from "../state/selection";
import { Icon, type IconName } from "./icons";

const PANEL_NAMES: Readonly<Record<Panel, string>> = { plan: "Plan", run: "Run" };

/** Plan or run, beside the map. Arrow keys move between the tabs. */
export function PanelTabs() {
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
    const next = PANELS.find((name) => name !== panel.value) ?? panel.value;
    showPanel(next);
    document.getElementById(`tab-${next}`)?.focus();
  };
  return (
    <div class="tabs" role="tablist" aria-label="Plan or run" onKeyDown={onKeyDown}>
      {PANELS.map((name) => (
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
          {PANEL_NAMES[name]}
        </button>
      ))}
    </div>
  );
}

const VIEW_NAMES: Readonly<Record<View, readonly [string, IconName]>> = {
  map: ["Map", "map"],
  fleet: ["Fleet", "fleet"],
  plan: ["Plan", "plan"],
  run: ["Run", "run"],
  feed: ["Events", "feed"],
};

/** The way around on a narrow page. */
export function ViewBar() {
  return (
    <nav class="view-bar" aria-label="Views">
      {(Object.entries(VIEW_NAMES) as [View, readonly [string, IconName]][]).map(([name, [text, icon]]) => (
        <button key={name} type="button" aria-current={view.value === name ? "page" : undefined} onClick={() => showView(name)}>
          <Icon name={icon} size={20} />
          {text}
        </button>
      ))}
    </nav>
  );
}
