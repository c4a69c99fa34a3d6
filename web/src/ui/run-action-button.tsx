import { useState } from "preact/hooks";
import { api } from "../api/client";
import type { Run } from "../api/types";
import type { Tone } from "../format/words";
import { report } from "../state/notices";
import type { RunAction } from "../state/runs";
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

/** One command to the vehicle of a run, held to confirm: it moves something heavy. It alone waits for its answer: a slow Pause must not keep anybody from Return. */
export function RunActionButton({ run, action }: { run: Run; action: RunAction }) {
  const [busy, setBusy] = useState(false);
  const [verb, tone] = VERBS[action];
  const send = async () => {
    setBusy(true);
    try {
      dispatch({ type: "run_read", run: await api.runAction(run.id, action) });
    } catch (error) {
      report(`${verb} ${run.vehicle_id}`, error);
    } finally {
      setBusy(false);
    }
  };
  return <HoldButton verb={verb} vehicle={run.vehicle_id} tone={tone} disabled={busy || !live.value} onConfirm={() => void send()} />;
}
