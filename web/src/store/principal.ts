/** Who the service takes this page for, and what that one may do. Read anew with each connection. */

import { effect, signal } from "@preact/signals";
import { api } from "../api/client";
import type { Principal, Role } from "../api/types";
import { live } from "./store";

/** Null before the service has said it, or if it is older than this question. */
export const principal = signal<Principal | null>(null);

/** Until it is known the page offers everything: the service judges each request anyway. */
export function may(role: Role): boolean {
  return principal.value?.may.includes(role) ?? true;
}

export function watchPrincipal(): void {
  effect(() => {
    if (!live.value) return;
    api
      .principal()
      .then((known) => (principal.value = known))
      .catch(() => (principal.value = null)); // what is refused is told where it is asked for
  });
}
