import { useState } from "preact/hooks";
import { api, type VehicleCommand } from "../../api/client";
import { toProblem } from "../../api/problem";
import type { Run, RunAction, RunState } from "../../api/types";
import type { Tone } from "../../format/labels";
import { commandVehicle } from "../../store/notices";
import { hasRole, pilotNote } from "../../store/principal";
import { dispatch, live } from "../../store/store";
import { HoldButton } from "../../ui/buttons";
import { RoleNote } from "../../ui/role-note";

const VERBS: Readonly<Record<RunAction, readonly [string, Tone]>> = {
  start: ["Start", "info"],
  pause: ["Pause", "info"],
  resume: ["Resume", "info"],
  return: ["Return", "warn"],
  divert: ["Divert", "warn"],
  land: ["Land", "warn"],
  abort: ["Abort", "danger"],
};

interface ActionProps {
  run: Run;
  action: RunAction;
  primary?: boolean;
}

/**
 * One command to the vehicle of a run, held to confirm: it moves something heavy. It alone waits for its answer: a
 * slow Pause must not keep anybody from Return.
 */
export function RunActionButton({ run, action, primary = false }: ActionProps) {
  const [busy, setBusy] = useState(false);
  const [verb, tone] = VERBS[action];
  const send = async () => {
    setBusy(true);
    await commandVehicle(`${verb} ${run.vehicle_id}`, run.vehicle_id, () => command(run, action));
    setBusy(false);
  };
  return (
    <HoldButton
      verb={verb}
      vehicle={run.vehicle_id}
      tone={tone}
      primary={primary}
      disabled={busy || !live.value || !mayAct(action)}
      onConfirm={() => void send()}
    />
  );
}

/** What the vehicle itself takes in place of a command to its run. */
const OF_VEHICLE: Partial<Record<RunAction, VehicleCommand>> = { pause: "hold", return: "return", land: "land" };

/**
 * A run that the service does not follow, because another gateway had it, takes no command: its vehicle does. Whoever
 * orders a return must not have to find that out.
 */
export async function command(run: Run, action: RunAction): Promise<void> {
  try {
    dispatch({ type: "run_read", run: await api.runAction(run.id, action) });
  } catch (error) {
    const instead = OF_VEHICLE[action];
    if (instead === undefined || toProblem(error).code !== "run.not_followed") throw error;
    await api.vehicleAction(run.vehicle_id, instead);
  }
}

interface ActionsProps {
  run: Run;
  /** Those of its plan. */
  rallyPoints: number;
  /** Something else is the next thing to do. */
  secondary?: boolean;
}

/** The actions that the state of the run allows; the first is the next thing to do. */
export function RunActions({ run, rallyPoints, secondary = false }: ActionsProps) {
  const actions = allowedActions(run, rallyPoints);
  if (actions.length === 0) return null;
  return (
    <>
      {!actions.every(mayAct) && <RoleNote>{pilotNote()}</RoleNote>}
      <div class="actions run-actions" aria-label={`Commands to ${run.vehicle_id}`} role="group">
        {actions.map((action, index) => (
          <RunActionButton key={action} run={run} action={action} primary={index === 0 && !secondary} />
        ))}
      </div>
    </>
  );
}

/** A dispatcher starts what is prepared; in flight, a pilot commands. */
export function mayAct(action: RunAction): boolean {
  return hasRole(action === "start" ? "dispatcher" : "pilot");
}

/**
 * What an operator may ask for. The service decides; this only keeps useless buttons away. `returning` is each way
 * down, landing too; in Return mode the service refuses to divert before a pause.
 */
const ALLOWED: Readonly<Record<RunState, readonly RunAction[]>> = {
  created: ["abort"],
  uploading: ["abort"],
  uploaded: ["start", "abort"],
  starting: ["abort"],
  flying: ["pause", "return", "divert", "land"],
  at_drop: ["pause", "return", "divert", "land"],
  paused: ["resume", "return", "divert", "land"],
  returning: ["pause", "return", "land"],
  landed: [],
  completed: [],
  aborted: [],
  failed: [],
  lost: [],
};

/** To a rally point only where the plan has some. */
export function allowedActions(run: Run, rallyPoints = 0): readonly RunAction[] {
  const allowed = ALLOWED[run.state] ?? [];
  return rallyPoints > 0 ? allowed : allowed.filter((action) => action !== "divert");
}
