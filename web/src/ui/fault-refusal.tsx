import { asSentence } from "../format/words";
import { dismissRefusal, refusals } from "../state/simulator";

/** Why a fault or the speed was not set: what was typed is no value, or the service said no. */
export function FaultRefusal({ fault, typed = "" }: { fault: string; typed?: string }) {
  const refused = refusals.value[fault];
  if (typed === "" && refused === undefined) return null;
  const words = refused === undefined ? "" : [refused.title, ...(refused.findings.length > 0 ? refused.findings.map((finding) => finding.message) : [refused.detail]), refused.hint].filter((part) => part !== "").map(asSentence).join(". ");
  return (
    <p class="form-problem" role="alert">
      {typed || words}
      {refused !== undefined && (
        <button type="button" class="small" onClick={() => dismissRefusal(fault)}>
          Dismiss
        </button>
      )}
    </p>
  );
}
