import { useState } from "preact/hooks";
import { api } from "../api/client";
import type { Run } from "../api/types";
import type { Tone } from "../format/words";
import { report } from "../state/notices";
import { allowedActions, type RunAction } from "../state/runs";
import { dispatch, live } from "../state/store";
import { HoldButton } from "./hold-button";

const VERBS: Readonly<Record<RunAction, readonly [string, Tone]>> = {
  start: ["Start", "ok"],
  pause: ["Pause", "info"],
  resume: ["Resume", "ok"],
  return: ["Return", "warn"],
  rally: ["Rally", "warn"],
  land: ["Land", "warn"],
  abort: ["Abort", "danger"],
};

/** What can be told to the vehicle of a run now; `rallyPoints` are those of its plan. All of it moves something heavy: each is held to confirm. */
export function RunActions({ run, rallyPoints }: { run: Run; rallyPoints: number }) {
  const [busy, setBusy] = useState<RunAction | null>(null); // only this one waits: a slow Pause must not keep anybody from Return
  const actions = allowedActions(run, rallyPoints);
  if (actions.length === 0) return null;
  const send = async (action: RunAction) => {
    setBusy(action);
    try {
      dispatch({ type: "run_read", run: await api.runAction(run.id, action) });
    } catch (error) {
      report(`${VERBS[action][0]} ${run.vehicle_id}`, error);
    } finally {
      setBusy(null);
    }
  };
  return (
    <div class="actions run-actions" aria-label={`Commands to ${run.vehicle_id}`} role="group">
      {actions.map((action) => (
        <HoldButton key={action} verb={VERBS[action][0]} vehicle={run.vehicle_id} tone={VERBS[action][1]} disabled={busy === action || !live.value} onConfirm={() => void send(action)} />
      ))}
    </div>
  );
}
