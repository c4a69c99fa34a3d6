import type { ComponentChildren } from "preact";
import { formatAge, UNIT_SYSTEMS, unitSystem } from "../format/units";
import { now, secondsSince } from "../store/clock";
import { chooseUnits, theme, toggleTheme } from "../store/preferences";
import { status, world } from "../store/store";
import { askForToken, retryNow } from "../store/sync";
import { Icon, Logo } from "../ui/icons";
import { showShortcuts } from "./shortcuts";

export function Header() {
  return (
    <header class="top">
      <h1>
        <a class="brand" href="/" aria-label="Waydrop">
          <Logo />
          <span>Waydrop</span>
        </a>
      </h1>
      <ConnectionState />
      <UnitSwitch />
      <a class="top-link" href="/api/v1/docs" target="_blank" rel="noopener">
        API
      </a>
      <button
        type="button"
        class="icon-button help"
        onClick={showShortcuts}
        aria-label="Keyboard shortcuts"
        title="Keyboard shortcuts (?)"
      >
        ?
      </button>
      <button
        type="button"
        class="icon-button"
        onClick={toggleTheme}
        aria-label={`Switch to the ${theme.value === "dark" ? "light" : "dark"} theme`}
      >
        <Icon name={theme.value === "dark" ? "sun" : "moon"} />
      </button>
    </header>
  );
}

/** For all that the page says; a plan's own fields stay in the plan's units. */
function UnitSwitch() {
  return (
    <select
      class="small units"
      aria-label="Units"
      title="Units on this page"
      value={unitSystem.value}
      onChange={(event) => chooseUnits(event.currentTarget.value)}
    >
      {Object.entries(UNIT_SYSTEMS).map(([name, { label }]) => (
        <option key={name} value={name}>
          {label}
        </option>
      ))}
    </select>
  );
}

/** Seen only: a screen reader would read the whole status with each second. */
function Counted({ children }: { children: ComponentChildren }) {
  return <span aria-hidden="true">{children}</span>;
}

/** Whether what is shown is live, and how old it is if not. */
function ConnectionState() {
  const current = status.value;
  const shown = world.value.measuredAt;
  const old = shown === null ? null : secondsSince(shown);
  switch (current.kind) {
    case "live":
      return <LiveState old={old} />;
    case "connecting":
      return (
        <p class={`connection ${shown === null ? "" : "lost"}`} role="status">
          <i />
          {shown === null ? (
            "Connecting…"
          ) : (
            <span>
              Connecting again<Counted>, data is {formatAge(old)} old</Counted>
            </span>
          )}
        </p>
      );
    case "token_needed":
      return (
        <p class="connection lost" role="status">
          <i />
          Access token required
          <button type="button" class="small" onClick={askForToken}>
            Enter token
          </button>
        </p>
      );
    case "waiting":
      return (
        <p class="connection lost" role="status">
          <i />
          <span>
            No connection{shown !== null && <Counted>, data is {formatAge(old)} old</Counted>}
            <small aria-hidden="true" title={current.reason}>
              retry in {Math.max(0, Math.ceil((current.retryAt - now.value) / 1000))} s
            </small>
          </span>
          <button type="button" class="small" onClick={retryNow}>
            Retry now
          </button>
        </p>
      );
  }
}

const NOT_RECORDED =
  "The service could not store or read the last events. What happened to runs, drops and jobs is shown once it can. Vehicles are current.";

/** What of that which is shown is not current, though the stream is open. */
function LiveState({ old }: { old: number | null }) {
  const { gateway, recording } = world.value;
  const isOld = old !== null && old > 2;
  return (
    <p class={`connection ${isOld || !recording ? "slow" : "live"}`} role="status">
      <i />
      {isOld ? (
        <span>
          No data<Counted> for {formatAge(old)}</Counted>
        </span>
      ) : recording ? (
        "Live"
      ) : (
        <span title={NOT_RECORDED}>Runs, drops and jobs may not be current</span>
      )}
      {gateway !== null && <small title="Id of this service in events and clusters">{gateway}</small>}
    </p>
  );
}
