import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { backoffSeconds, type ConnectionStatus, StreamConnection, type StreamHost } from "./stream";
import type { StreamFrame } from "./types";

class FakeSocket {
  static all: FakeSocket[] = [];
  onopen: (() => void) | null = null;
  onmessage: ((message: { data: string }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;
  closed = false;

  constructor(
    readonly url: string,
    readonly protocols: string[],
  ) {
    FakeSocket.all.push(this);
  }

  close(): void {
    this.closed = true;
  }

  send(frame: StreamFrame): void {
    this.onmessage?.({ data: JSON.stringify(frame) });
  }
}

const HELLO: StreamFrame = { type: "hello", gateway: "gw1", first_seq: 1, seq: 7, server_time: 0 };
const SNAPSHOT: StreamFrame = { type: "snapshot", seq: 7, vehicles: [], runs: [] };

let statuses: ConnectionStatus[];
let after: number | null;
let token: string | null;
let resync: boolean;
let refused: number;

function open(): StreamConnection {
  const host: StreamHost = {
    after: () => after,
    gateway: () => null,
    token: () => token,
    onStatus: (status) => statuses.push(status),
    onOpen: () => undefined,
    onFrame: () => resync,
    onAfterRefused: () => (refused += 1),
  };
  const connection = new StreamConnection(host);
  connection.open();
  return connection;
}

const last = () => FakeSocket.all.at(-1) as FakeSocket;

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("WebSocket", FakeSocket);
  vi.stubGlobal("window", { location: { href: "http://drones.example:8080/#x" } });
  FakeSocket.all = [];
  [statuses, after, token, resync, refused] = [[], null, null, false, 0];
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

describe("a connection", () => {
  it("asks for what comes after the last event, and for nothing when there is none", () => {
    open();
    expect(last().url).toBe("ws://drones.example:8080/api/v1/stream");
    after = 41;
    last().onclose?.({ code: 1006, reason: "" });
    vi.advanceTimersByTime(60_000);
    expect(FakeSocket.all[1]?.url).toBe("ws://drones.example:8080/api/v1/stream?after=41");
  });

  it("sends the token as a subprotocol, never in the address", () => {
    token = "abc";
    open();
    expect(last().protocols).toEqual(["waydrop.v1", "bearer.abc"]);
    expect(last().url).not.toContain("abc");
  });

  it("is live only when the snapshot is here", () => {
    open();
    last().onopen?.();
    last().send(HELLO);
    expect(statuses.map(({ kind }) => kind)).toEqual(["connecting"]);
    last().send(SNAPSHOT);
    expect(statuses.at(-1)?.kind).toBe("live");
  });

  it("tries again after a loss, with longer and longer waits", () => {
    vi.spyOn(Math, "random").mockReturnValue(0.5);
    open();
    const waits = [0, 1, 2, 3, 4, 5, 6].map(() => {
      const began = Date.now();
      last().onclose?.({ code: 1006, reason: "" });
      vi.advanceTimersToNextTimer();
      return Date.now() - began;
    });
    expect(waits).toEqual([375, 750, 1500, 3000, 6000, 7500, 7500]);
    expect(FakeSocket.all.length).toBe(8);
  });

  it("does not try again without a token that is asked for", () => {
    open();
    last().onclose?.({ code: 4401, reason: "" });
    vi.advanceTimersByTime(60_000);
    expect([FakeSocket.all.length, statuses.at(-1)]).toEqual([1, { kind: "token_needed", rejected: false }]);
  });

  it("tells a token that was rejected from none", () => {
    token = "old-token";
    open();
    last().onclose?.({ code: 4401, reason: "" });
    expect(statuses.at(-1)).toEqual({ kind: "token_needed", rejected: true });
  });

  it.each([
    [4409, "in the future"],
    [4411, "deleted by age"],
  ])("forgets its place at close code %d: it is %s", (code) => {
    open();
    last().onclose?.({ code, reason: "" });
    expect(refused).toBe(1);
    vi.advanceTimersToNextTimer();
    expect(FakeSocket.all.length).toBe(2);
  });

  it("opens again at once when there is a hole, but never in a tight loop", () => {
    open();
    resync = true;
    last().send(HELLO);
    expect(FakeSocket.all.map(({ closed }) => closed)).toEqual([true, false]);
    last().send(HELLO);
    expect([FakeSocket.all.length, statuses.at(-1)?.kind]).toEqual([2, "waiting"]);
  });

  it("takes silence for a loss", () => {
    open();
    last().send(SNAPSHOT);
    vi.advanceTimersByTime(15_100);
    expect(statuses.at(-1)?.kind).toBe("waiting");
    expect(FakeSocket.all[0]?.closed).toBe(true);
  });

  it("ignores a socket that it has given up", () => {
    const connection = open();
    const old = last();
    connection.open();
    old.onclose?.({ code: 1006, reason: "" });
    old.send(SNAPSHOT);
    expect(statuses.map(({ kind }) => kind)).toEqual(["connecting", "connecting"]);
  });

  it("waits no longer when it is woken, and does nothing when it is open", () => {
    const connection = open();
    connection.wake();
    expect(FakeSocket.all.length).toBe(1);
    last().onclose?.({ code: 1006, reason: "" });
    connection.wake();
    expect(FakeSocket.all.length).toBe(2);
  });

  it("gives up what is open when the computer has slept, but asks for no token again", () => {
    const connection = open();
    last().send(SNAPSHOT);
    connection.wake(true);
    expect([FakeSocket.all.map(({ closed }) => closed), statuses.at(-1)?.kind]).toEqual([[true, false], "connecting"]);
    last().onclose?.({ code: 4401, reason: "" });
    connection.wake(true);
    expect([FakeSocket.all.length, statuses.at(-1)?.kind]).toEqual([2, "token_needed"]);
  });
});

it("the waits double, stay under ten seconds and are never zero", () => {
  expect([0, 1, 2, 3].map((attempt) => backoffSeconds(attempt, 0.999).toFixed(1))).toEqual([
    "0.5",
    "1.0",
    "2.0",
    "4.0",
  ]);
  for (let attempt = 0; attempt < 50; attempt++) {
    expect(backoffSeconds(attempt, 0)).toBeGreaterThanOrEqual(0.25);
    expect(backoffSeconds(attempt, 0.999)).toBeLessThanOrEqual(10);
  }
});
