/** Ties the stream to the store: the connection's host, the token, and reading again what events only hinted at. */

import { effect, signal } from "@preact/signals";
import { api } from "../api/client";
import { StreamConnection } from "../api/stream";
import { readToken, storeToken } from "../api/token";
import { reportProblem } from "./notices";
import { principal } from "./principal";
import { dispatch, journalName, lastSeq, live, receiveFrame, status, world } from "./store";

/** Counts how often a token was asked for: the dialog opens each time, also after somebody closed it. */
export const tokenAsked = signal(0);

const connection = new StreamConnection({
  after: lastSeq,
  gateway: journalName,
  token: readToken,
  onStatus: (next) => {
    status.value = next;
    if (next.kind === "token_needed") askForToken();
  },
  onOpen: () => dispatch({ type: "opened" }),
  onFrame: receiveFrame,
  onAfterRefused: () => dispatch({ type: "after_refused" }),
});

export function startSync(): void {
  connection.open();
  window.addEventListener("online", () => connection.wake());
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden) connection.wake();
  });
  effect(() => {
    if (world.value.listStale && live.value) readVehicles();
  });
}

export function retryNow(): void {
  connection.open();
}

/** The computer slept: the connection is dead, whatever it looks like. */
export function reopen(): void {
  connection.wake(true);
}

export function askForToken(): void {
  tokenAsked.value += 1;
}

export function enterToken(token: string): void {
  storeToken(token);
  principal.value = null; // the roles were the other token's
  connection.open();
}

const READ_AGAIN_MS = 5_000;
let reading = false;

function readVehicles(): void {
  if (reading) return;
  reading = true;
  const asked = world.peek();
  api
    .vehicles()
    .then((read) => dispatch({ type: "vehicles_read", vehicles: read, asked }))
    .catch(async (error: unknown) => {
      reportProblem("Load the fleet", error);
      await new Promise((later) => setTimeout(later, READ_AGAIN_MS)); // frames come several times a second
    })
    .finally(() => (reading = false));
}
