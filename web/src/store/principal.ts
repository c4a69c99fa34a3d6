/** Who the service takes this page for, and what that one may do. Read anew with each connection. */

import { effect, signal } from "@preact/signals";
import { api } from "../api/client";
import type { Principal, Role } from "../api/types";
import { roleLabel } from "../format/labels";
import { live } from "./store";

/** Null before the service has said it, or if it is older than this question. */
export const principal = signal<Principal | null>(null);

/** Until it is known the page offers everything: the service judges each request anyway. */
export function hasRole(role: Role): boolean {
  return principal.value?.roles.includes(role) ?? true;
}

export function watchPrincipal(): void {
  let asked = 0;
  effect(() => {
    asked += 1; // an answer to an earlier connection may be about another token
    if (!live.value) return;
    const question = asked;
    const take = (known: Principal | null) => {
      if (question === asked) principal.value = known;
    };
    api.principal().then(take, () => take(null)); // a refusal is shown where the action is
  });
}

/** Why commands are not offered; null for a pilot. */
export function pilotNote(): string | null {
  return hasRole("pilot") ? null : `Only a pilot can control vehicles. ${signedInAs(principal.value)}`;
}

/** "You are signed in as desk (viewer)." */
export function signedInAs(who: Principal | null): string {
  return who === null ? "" : `You are signed in as ${who.name} (${roleLabel(who.role)}).`;
}
