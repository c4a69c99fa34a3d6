import { computed } from "@preact/signals";
import { useState } from "preact/hooks";
import type { Offboard, StreamEvent } from "../../api/types";
import { may, principal } from "../../store/principal";
import { feed, live } from "../../store/store";
import { HoldButton, PassingButton } from "../../ui/buttons";
import { detail, flownBy, followsControls, tasksOnly } from "./capabilities";
import { handOver, takeLease } from "./control-session";
import { manualControl, offboardNow } from "./control-state";
import { takeOverWords } from "./labels";

/** Without a lease: who has it, why the last one ended, and the ways to take it. */
export function OffboardLease({ vehicle }: { vehicle: string }) {
  const { ended, fellSilent } = manualControl.value;
  return (
    <>
      {ended !== "" && (
        <div class="offboard-note tone-info" role="status">
          <b>{tasksOnly.value ? "Control has ended" : "Manual control off"}</b>
          <p>
            {ended} {fellSilent && `${vehicle} was told to hold; to fly on, take a new lease.`}
          </p>
        </div>
      )}
      {live.value ? (
        <Takeable vehicle={vehicle} />
      ) : (
        <p>The connection is lost, and a lease that this page had is lost with it.</p>
      )}
    </>
  );
}

/** As the service says it now: what was heard last may be one's own lease that has ended since. */
function Takeable({ vehicle }: { vehicle: string }) {
  const offboard = offboardNow.value;
  const holder = offboard?.lease?.holder ?? null;
  return (
    <>
      <p class="offboard-holder" data-holder={holder ?? ""}>
        {holder === null
          ? `Nobody has the lease of ${vehicle}.`
          : `${holder} has the lease of ${vehicle}${expiry(offboard?.lease?.expires_in_s)}.`}
      </p>
      {!may("pilot") && (
        <p class="role-note" role="note">
          You may look. Vehicles are flown by a pilot; {principal.value?.name} is a {principal.value?.role}.
        </p>
      )}
      {isOfferedToMe(offboard) ? (
        <TakeOver vehicle={vehicle} offboard={offboard} />
      ) : (
        canTake() && (
          <button type="button" class="primary" disabled={!mayTake()} onClick={() => takeLease(vehicle)}>
            Take the lease of {vehicle}
          </button>
        )
      )}
      {canTake() && (
        <p class="hint">
          One client flies a vehicle at a time.{!isFlown(offboard) && " To take the lease moves nothing."}
        </p>
      )}
      {holder !== null && !isOfferedToMe(offboard) && may("admin") && canTake() && (
        <Override vehicle={vehicle} holder={holder} offboard={offboard} />
      )}
    </>
  );
}

/** There is something to do with it: manual control, or tasks. Nothing is offered where the vehicle follows neither. */
function canTake(): boolean {
  return detail.value === null || followsControls() || tasksOnly.value;
}

function mayTake(): boolean {
  return live.value && may("pilot") && detail.value !== null && canTake();
}

function isOfferedToMe(offboard: Offboard | null): boolean {
  const me = principal.value?.name ?? null;
  return me !== null && offboard?.lease?.offered_to === me;
}

function isFlown(offboard: Offboard | null): boolean {
  return offboard?.state === "active";
}

function takenInFlight(vehicle: string): string {
  const by = flownBy.value;
  return tasksOnly.value && by !== null
    ? takeOverWords(vehicle, by)
    : `${vehicle} is in the air and stands still from the moment you take it: be ready to fly.`;
}

/** It was offered; in flight manual control is on from the first moment. */
function TakeOver({ vehicle, offboard }: { vehicle: string; offboard: Offboard | null }) {
  return (
    <div class="offboard-note tone-warn">
      <b>Offered to you</b>
      <p>{isFlown(offboard) ? takenInFlight(vehicle) : `Nothing moves when you take it.`}</p>
      <div class="actions">
        <HoldButton
          verb="Take over"
          vehicle={vehicle}
          tone="warn"
          disabled={!mayTake()}
          onConfirm={() => takeLease(vehicle)}
        />
      </div>
    </div>
  );
}

/** From somebody who did not offer it: for admins, held to confirm. */
function Override({ vehicle, holder, offboard }: { vehicle: string; holder: string; offboard: Offboard | null }) {
  return (
    <div class="offboard-note tone-danger">
      <b>Take it from {holder}</b>
      <p>
        As an admin you can take the lease without being asked. {holder} loses it at once.{" "}
        {isFlown(offboard) && takenInFlight(vehicle)}
      </p>
      <div class="actions">
        <HoldButton
          verb={`Override ${holder}'s lease of`}
          vehicle={vehicle}
          tone="danger"
          disabled={!mayTake()}
          onConfirm={() => takeLease(vehicle, true)}
        />
      </div>
    </div>
  );
}

function expiry(left_s: number | undefined): string {
  return left_s === undefined ? "" : `, for ${Math.ceil(left_s)} s unless it is used`;
}

/** Let somebody else take the lease over. The vehicle is flown on from here until that one takes it. */
export function OffboardOffer({ vehicle }: { vehicle: string }) {
  const offered = offboardNow.value?.lease?.offered_to ?? null;
  return (
    <section class="hand-over" aria-label={`Hand ${vehicle} over`}>
      {offered === null ? (
        <Offer vehicle={vehicle} />
      ) : (
        <p role="status">
          <span>
            Offered to <b>{offered}</b>, who can take {vehicle} over on the Manual control panel. Until then it is
            yours.
          </span>
          <PassingButton name="Take the offer back" onClick={() => void handOver(null)} />
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
      <summary>Hand {vehicle} over</summary>
      <label>
        <span>To whom (the name of their token)</span>
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
        {knownNames.value.map((known) => (
          <option key={known} value={known} />
        ))}
      </datalist>
      <HoldButton
        verb={name === "" ? "Offer" : `Offer ${name} the lease of`}
        vehicle={vehicle}
        tone="warn"
        disabled={name === ""}
        onConfirm={() => void handOver(name)}
      />
    </details>
  );
}

// Names that a lease could be handed over to: those who had one, or commanded something, as far as the feed goes back.

/** As text: the feed changes all the time, and who is in it seldom. */
const names = computed(() => JSON.stringify(namesIn(feed.value, principal.value?.name ?? null)));
export const knownNames = computed<readonly string[]>(() => JSON.parse(names.value) as string[]);

/** Who an event tells of, whatever its kind. */
function namesOf({ data }: StreamEvent): unknown[] {
  return ["holder", "other", "actor", "requested_by"].map((field) => Reflect.get(data, field));
}

function namesIn(events: readonly StreamEvent[], own: string | null): string[] {
  const found = new Set(
    [...events.flatMap(namesOf), own].filter((name): name is string => typeof name === "string" && name !== ""),
  );
  return [...found].sort();
}
