import { computed } from "@preact/signals";
import { useState } from "preact/hooks";
import type { Offboard, StreamEvent } from "../../api/types";
import { hasRole, pilotNote, principal } from "../../store/principal";
import { feed, live } from "../../store/store";
import { HoldButton, TransientButton } from "../../ui/buttons";
import { RoleNote } from "../../ui/role-note";
import { acceptsControls, controlMethod, offboardDetail, tasksOnly } from "./capabilities";
import { acquireLease, offerLease } from "./control-session";
import { manualControl, offboardState } from "./control-state";
import { takeOverHint } from "./labels";

/** Without a lease: who has it, why the last one ended, and the ways to take it. */
export function LeaseSection({ vehicle }: { vehicle: string }) {
  const { ended, fellSilent } = manualControl.value;
  return (
    <>
      {ended !== "" && (
        <div class="offboard-note tone-info" role="status">
          <b>{tasksOnly.value ? "Control ended" : "Manual control off"}</b>
          <p>
            {ended} {fellSilent && `${vehicle} holds. To continue, acquire the lease again.`}
          </p>
        </div>
      )}
      {live.value ? <Takeable vehicle={vehicle} /> : <p>No connection. A lease of this page is lost with it.</p>}
    </>
  );
}

/** Reads the current holder: the last report may be this page's own lease, which has ended since. */
function Takeable({ vehicle }: { vehicle: string }) {
  const offboard = offboardState.value;
  const holder = offboard?.lease?.holder ?? null;
  return (
    <>
      <p class="offboard-holder" data-holder={holder ?? ""}>
        {holder === null
          ? `Nobody has the lease of ${vehicle}.`
          : `${holder} has the lease of ${vehicle}${expiry(offboard?.lease?.expires_in_s)}.`}
      </p>
      <RoleNote>{pilotNote()}</RoleNote>
      {isOfferedToMe(offboard) ? (
        <TakeOver vehicle={vehicle} offboard={offboard} />
      ) : (
        canTake() && (
          <button type="button" class="primary" disabled={!mayTake()} onClick={() => acquireLease(vehicle)}>
            Take the lease of {vehicle}
          </button>
        )
      )}
      {canTake() && (
        <p class="hint">
          One client controls a vehicle at a time.{!isFlown(offboard) && " Taking the lease moves nothing."}
        </p>
      )}
      {holder !== null && !isOfferedToMe(offboard) && hasRole("admin") && canTake() && (
        <Override vehicle={vehicle} holder={holder} offboard={offboard} />
      )}
    </>
  );
}

/** There is something to do with it: manual control, or tasks. Nothing is offered where the vehicle follows neither. */
function canTake(): boolean {
  return offboardDetail.value === null || acceptsControls() || tasksOnly.value;
}

function mayTake(): boolean {
  return live.value && hasRole("pilot") && offboardDetail.value !== null && canTake();
}

function isOfferedToMe(offboard: Offboard | null): boolean {
  const me = principal.value?.name ?? null;
  return me !== null && offboard?.lease?.offered_to === me;
}

function isFlown(offboard: Offboard | null): boolean {
  return offboard?.state === "active";
}

function takenInFlight(vehicle: string): string {
  const by = controlMethod.value;
  return tasksOnly.value && by !== null
    ? takeOverHint(vehicle, by)
    : `${vehicle} is in the air and stops when you take over. Be ready to fly.`;
}

/** It was offered; in flight manual control is on from the first moment. */
function TakeOver({ vehicle, offboard }: { vehicle: string; offboard: Offboard | null }) {
  return (
    <div class="offboard-note tone-warn">
      <b>Offered to you</b>
      <p>{isFlown(offboard) ? takenInFlight(vehicle) : "Taking over moves nothing."}</p>
      <div class="actions">
        <HoldButton
          verb="Take over"
          vehicle={vehicle}
          tone="warn"
          disabled={!mayTake()}
          onConfirm={() => acquireLease(vehicle)}
        />
      </div>
    </div>
  );
}

/** Takes a lease that was not offered: for admins, held to confirm. */
function Override({ vehicle, holder, offboard }: { vehicle: string; holder: string; offboard: Offboard | null }) {
  return (
    <div class="offboard-note tone-danger">
      <b>Override the lease of {holder}</b>
      <p>
        As an admin you can take the lease without an offer. {holder} loses it at once.{" "}
        {isFlown(offboard) && takenInFlight(vehicle)}
      </p>
      <div class="actions">
        <HoldButton
          verb={`Override ${holder}'s lease of`}
          vehicle={vehicle}
          tone="danger"
          disabled={!mayTake()}
          onConfirm={() => acquireLease(vehicle, true)}
        />
      </div>
    </div>
  );
}

function expiry(left_s: number | undefined): string {
  return left_s === undefined ? "" : ` for ${Math.ceil(left_s)} s more, unless it is renewed`;
}

/** Let another client take the lease over. This page controls the vehicle until then. */
export function OfferSection({ vehicle }: { vehicle: string }) {
  const offered = offboardState.value?.lease?.offered_to ?? null;
  return (
    <section class="hand-over" aria-label={`Hand over ${vehicle}`}>
      {offered === null ? (
        <Offer vehicle={vehicle} />
      ) : (
        <p role="status">
          <span>
            Offered to <b>{offered}</b>, who can take over {vehicle} on the Manual control panel. Until then you keep
            it.
          </span>
          <TransientButton name="Withdraw the offer" onClick={() => void offerLease(null)} />
        </p>
      )}
    </section>
  );
}

const MAX_NAME_CHARS = 100;

function Offer({ vehicle }: { vehicle: string }) {
  const [typed, setTyped] = useState("");
  const name = typed.trim();
  return (
    <details>
      <summary>Hand over {vehicle}</summary>
      <label>
        <span>Recipient (name of their token)</span>
        <input
          type="text"
          list="pilot-names"
          autocomplete="off"
          maxLength={MAX_NAME_CHARS}
          value={typed}
          onInput={(event) => setTyped(event.currentTarget.value)}
        />
      </label>
      <datalist id="pilot-names">
        {knownPilots.value.map((known) => (
          <option key={known} value={known} />
        ))}
      </datalist>
      <HoldButton
        verb={name === "" ? "Offer" : `Offer ${name} the lease of`}
        vehicle={vehicle}
        tone="warn"
        disabled={name === ""}
        onConfirm={() => void offerLease(name)}
      />
    </details>
  );
}

// Names that a lease could be handed over to: those who had one, or commanded something, as far as the feed goes back.

/** As text: the feed changes all the time, and who is in it seldom. */
const names = computed(() => JSON.stringify(namesIn(feed.value, principal.value?.name ?? null)));
const knownPilots = computed<readonly string[]>(() => JSON.parse(names.value) as string[]);

/** The people that an event names. */
function namesOf(event: StreamEvent): (string | null)[] {
  switch (event.kind) {
    case "offboard.lease":
      return [event.data.holder, event.data.other];
    case "offboard.changed":
      return [event.data.holder];
    case "vehicle.command":
    case "drop.consent_closed":
      return [event.data.actor];
    case "run.created":
      return [event.data.requested_by];
    default:
      return [];
  }
}

function namesIn(events: readonly StreamEvent[], own: string | null): string[] {
  const named = [...events.flatMap(namesOf), own].filter((name) => name !== null);
  return [...new Set(named.filter((name) => name !== ""))].sort();
}
