import { handsOn, offboardNow } from "../state/hands-on";
import { takeLease } from "../state/hands-session";
import { follows } from "../state/offboard-facts";
import { may, principal } from "../state/principal";
import { live } from "../state/store";

/** Without a lease: who has it, why the last one ended, and the way to take it. */
export function HandsLease({ vehicle }: { vehicle: string }) {
  const { ended, fellSilent } = handsOn.value;
  const holder = offboardNow.value?.lease?.holder ?? null;
  return (
    <>
      {ended !== "" && (
        <div class="hands-note tone-info" role="status">
          <b>Hands off</b>
          <p>
            {ended} {fellSilent && `${vehicle} was told to hold; to fly on, take a new lease.`}
          </p>
        </div>
      )}
      <p class="hands-holder" data-holder={holder ?? ""}>
        {holder === null ? `Nobody has the lease of ${vehicle}.` : `${holder} has the lease of ${vehicle}${expiry(offboardNow.value?.lease?.expires_in_s)}.`}
      </p>
      {!may("pilot") && (
        <p class="role-note" role="note">
          You may look. Vehicles are flown by a pilot; {principal.value?.name} is a {principal.value?.role}.
        </p>
      )}
      <button type="button" class="primary" disabled={!live.value || !may("pilot") || !follows("velocity_body")} onClick={() => takeLease(vehicle)}>
        Take the lease of {vehicle}
      </button>
      <p class="hint">One client flies a vehicle at a time. To take the lease moves nothing.</p>
    </>
  );
}

function expiry(left_s: number | undefined): string {
  return left_s === undefined ? "" : `, for ${Math.ceil(left_s)} s unless it is used`;
}
