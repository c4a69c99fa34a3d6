import { live } from "./state/store";
import { panel, view } from "./state/selection";
import { ConsentCalls } from "./ui/consent-calls";
import { Feed } from "./ui/feed";
import { FileDrop } from "./ui/file-drop";
import { Fleet } from "./ui/fleet";
import { OffboardPanel } from "./ui/hands-on-panel";
import { Header } from "./ui/header";
import { JobsPanel } from "./ui/jobs-panel";
import { MapView } from "./ui/map-view";
import { Notices } from "./ui/notices";
import { PlanPanel } from "./ui/plan-panel";
import { RunPanel } from "./ui/run-panel";
import { SimulatorPanel } from "./ui/simulator-panel";
import { PANEL_NAMES, PanelTabs, ViewBar } from "./ui/tabs";
import { TokenDialog } from "./ui/token-dialog";

export function App() {
  return (
    <div class={`page${live.value ? "" : " not-live"}`} data-view={view.value}>
      <a class="skip" href="#panel">
        Skip to the panel
      </a>
      <Header />
      <main>
        <MapView />
        <Fleet />
        <Feed />
        <section class="card panel" aria-label="Panel">
          <h2 class="visually-hidden">{PANEL_NAMES[panel.value]}</h2>
          <PanelTabs />
          <div key={panel.value} id="panel" role="tabpanel" aria-labelledby={`tab-${panel.value}`} tabIndex={-1}>
            <Shown />
          </div>
        </section>
      </main>
      <ViewBar />
      <FileDrop />
      <ConsentCalls />
      <Notices />
      <TokenDialog />
    </div>
  );
}

function Shown() {
  switch (panel.value) {
    case "plan":
      return <PlanPanel />;
    case "run":
      return <RunPanel />;
    case "jobs":
      return <JobsPanel />;
    case "offboard":
      return <OffboardPanel />;
    case "simulator":
      return <SimulatorPanel />;
  }
}
