import type { Offboard } from "../api/types";
import { manualControl, offboardNow } from "../state/hands-on";
import { takeLease } from "../state/hands-session";
import { takeOverWords } from "../hands-on/commanded";
import { detail, flownBy, followsControls, tasksOnly } from "../state/offboard-facts";
import { may, principal } from "../state/principal";
import { live } from "../state/store";
import { HoldButton } from "./hold-button";

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
      {live.value ? <Takeable vehicle={vehicle} /> : <p>The connection is lost, and a lease that this page had is lost with it.</p>}
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
        {holder === null ? `Nobody has the lease of ${vehicle}.` : `${holder} has the lease of ${vehicle}${expiry(offboard?.lease?.expires_in_s)}.`}
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
      {canTake() && <p class="hint">One client flies a vehicle at a time.{!isFlown(offboard) && " To take the lease moves nothing."}</p>}
      {holder !== null && !isOfferedToMe(offboard) && may("admin") && canTake() && <Override vehicle={vehicle} holder={holder} offboard={offboard} />}
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
  return tasksOnly.value && by !== null ? takeOverWords(vehicle, by) : `${vehicle} is in the air and stands still from the moment you take it: be ready to fly.`;
}

/** It was offered; in flight manual control is on from the first moment. */
function TakeOver({ vehicle, offboard }: { vehicle: string; offboard: Offboard | null }) {
  return (
    <div class="offboard-note tone-warn">
      <b>Offered to you</b>
      <p>{isFlown(offboard) ? takenInFlight(vehicle) : `Nothing moves when you take it.`}</p>
      <div class="actions">
        <HoldButton verb="Take over" vehicle={vehicle} tone="warn" disabled={!mayTake()} onConfirm={() => takeLease(vehicle)} />
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
        As an admin you can take the lease without being asked. {holder} loses it at once. {isFlown(offboard) && takenInFlight(vehicle)}
      </p>
      <div class="actions">
        <HoldButton verb={`Override ${holder}'s lease of`} vehicle={vehicle} tone="danger" disabled={!mayTake()} onConfirm={() => takeLease(vehicle, true)} />
      </div>
    </div>
  );
}

function expiry(left_s: number | undefined): string {
  return left_s === undefined ? "" : `, for ${Math.ceil(left_s)} s unless it is used`;
}
