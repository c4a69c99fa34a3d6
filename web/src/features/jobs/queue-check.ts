/** What the service says of a job that is about to be queued: it need not suit the vehicle that is selected. */

import { useEffect, useState } from "preact/hooks";
import { api } from "../../api/client";
import { toProblem } from "../../api/problem";
import type { JobRequest, PlanDocument } from "../../api/types";
import type { Tone } from "../../format/labels";
import { toSentences } from "../../format/text";
import { live } from "../../store/store";
import { draftPlan } from "../plan/draft-text";
import { wind } from "../plan/wind";
import { describeAssignment } from "./labels";

const CHECK_DELAY_MS = 300;

export interface QueueCheck {
  readonly canQueue: boolean;
  readonly text: string;
  readonly tone: Tone;
}

const CHECKING: QueueCheck = { canQueue: false, text: "Checking…", tone: "neutral" };
const OFFLINE: QueueCheck = { canQueue: false, text: "Not checked: no connection.", tone: "neutral" };

type JobSettings = Omit<JobRequest, "plan" | "wind">;

/** Of the plan in the editor; `settings` null: nothing is asked. */
export function useQueueCheck(settings: JobSettings | null): QueueCheck {
  const [check, setCheck] = useState(CHECKING);
  const [plan, air, isLive] = [draftPlan.value, wind.value, live.value];
  const key = JSON.stringify(settings);
  useEffect(() => {
    if (plan === null || settings === null || !isLive) {
      setCheck(isLive ? CHECKING : OFFLINE);
      return undefined;
    }
    setCheck(CHECKING);
    const abort = new AbortController();
    const ask = async () => {
      const found = await checkOrder({ ...settings, plan, wind: air }, abort.signal);
      if (!abort.signal.aborted) setCheck(found);
    };
    const timer = setTimeout(() => void ask(), CHECK_DELAY_MS);
    return () => {
      clearTimeout(timer);
      abort.abort();
    };
  }, [plan, air, isLive, key]);
  return check;
}

/** A plan with errors of its own is refused; one that no vehicle can take now waits. */
async function checkOrder(order: JobRequest, signal: AbortSignal): Promise<QueueCheck> {
  try {
    const { findings } = await api.checkPlan(order.plan as PlanDocument, null, order.wind ?? null, signal);
    const error = findings.find(({ severity }) => severity === "error");
    if (error !== undefined) return refused(toSentences(error.message, error.hint));
    return { canQueue: true, ...describeAssignment(await api.checkJob(order, signal)) };
  } catch (problem) {
    const { title, detail, hint } = toProblem(problem);
    return refused(toSentences(title, detail, hint));
  }
}

function refused(text: string): QueueCheck {
  return { canQueue: false, text, tone: "danger" };
}
