import type { ComponentChildren } from "preact";
import { formatLinkAge, formatMoment } from "../../format/units";
import { type LinkLoss, linkLoss } from "../../store/link-loss";
import { today } from "../../store/store";
import { Icon } from "../../ui/icons";
import { useStableComputed } from "../../ui/use-stable-computed";

/** Where commands are: nothing may look live that is not. The commands stay, because a return may still get through. */
export function LinkLost({ vehicle }: { vehicle: string }) {
  const loss = useLinkLoss(vehicle);
  if (loss === null) return null;
  return (
    <LinkLostStrip vehicle={vehicle} age={loss.age}>
      {loss.heardAt === "" ? "The values shown are old." : `The values shown are from ${loss.heardAt}.`} Commands
      probably do not arrive. A return or landing may still get through.
    </LinkLostStrip>
  );
}

/** In a question: whoever answers must know that nobody sees the vehicle. */
export function LinkLostAtDrop({ vehicle }: { vehicle: string }) {
  const loss = useLinkLoss(vehicle);
  if (loss === null) return null;
  return (
    <LinkLostStrip vehicle={vehicle} age={loss.age}>
      The values below are older. A release is sent only if {vehicle} is heard again in time, still at the drop.
    </LinkLostStrip>
  );
}

function LinkLostStrip({ vehicle, age, children }: { vehicle: string; age: string; children: ComponentChildren }) {
  return (
    <div class="link-lost tone-danger" role="alert">
      <Icon name="link" size={18} />
      <p>
        <b>
          Link to {vehicle} lost<span aria-hidden="true">{age}</span>.
        </b>{" "}
        {children}
      </p>
    </div>
  );
}

function useLinkLoss(vehicle: string): { readonly heardAt: string; readonly age: string } | null {
  return useStableComputed(() => wordsOf(linkLoss(vehicle))).value;
}

function wordsOf(loss: LinkLoss | null) {
  if (loss === null) return null;
  return {
    heardAt: loss.heardAt === null ? "" : formatMoment(loss.heardAt, today.value),
    age: loss.age_s === null ? "" : ` for ${formatLinkAge(loss.age_s)}`,
  };
}
