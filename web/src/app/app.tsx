import { Feed } from "../features/feed/feed";
import { FleetList } from "../features/fleet/fleet-list";
import { JobsPanel } from "../features/jobs/jobs-panel";
import { QueueForm } from "../features/jobs/queue-form";
import { MapView } from "../features/map/map-view";
import { OffboardPanel } from "../features/offboard/offboard-panel";
import { PlanPanel } from "../features/plan/plan-panel";
import { FileDrop } from "../features/plan/plan-source";
import { ConsentAlerts } from "../features/run/consent";
import { RunPanel } from "../features/run/run-panel";
import { SimulatorPanel } from "../features/simulator/simulator-panel";
import { TasksSection } from "../features/tasks/tasks-section";
import { TourBar, TourOffer } from "../features/tour/tour-bar";
import { panel, view } from "../store/selection";
import { live } from "../store/store";
import { Header } from "./header";
import { PANEL_LABELS, PanelTabs, ViewBar } from "./navigation";
import { Notices } from "./notices";
import { Shortcuts } from "./shortcuts";
import { TokenDialog } from "./token-dialog";

export function App() {
  return (
    <div class={`page${live.value ? "" : " not-live"}`} data-view={view.value}>
      <a class="skip" href="#panel">
        Skip to the panel
      </a>
      <div>
        <Header />
        <TourBar />
        <ConsentAlerts />
        <Notices />
      </div>
      <main>
        <MapView />
        <FleetList />
        <Feed />
        <section class="card panel" aria-label="Panel">
          <h2 class="visually-hidden">{PANEL_LABELS[panel.value]}</h2>
          <PanelTabs />
          <div key={panel.value} id="panel" role="tabpanel" aria-labelledby={`tab-${panel.value}`} tabIndex={-1}>
            <Shown />
          </div>
        </section>
      </main>
      <ViewBar />
      <FileDrop />
      <TokenDialog />
      <Shortcuts />
    </div>
  );
}

function Shown() {
  switch (panel.value) {
    case "plan":
      return <PlanPanel queue={<QueueForm />} />;
    case "run":
      return <RunPanel firstFlight={<TourOffer />} />;
    case "jobs":
      return <JobsPanel />;
    case "offboard":
      return <OffboardPanel tasks={(vehicle) => <TasksSection vehicle={vehicle} />} />;
    case "simulator":
      return <SimulatorPanel />;
  }
}
