import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { SetpointSender, type StopReason } from "./sender";
import { positionSetpoint, type Setpoint } from "./setpoint";

const SETPOINT = positionSetpoint([8.5, 47.4], 500);
const PERIOD_MS = 50;

let sent: number[];
let asked: Setpoint | StopReason;
let stopped: StopReason[];
let answers: boolean;
let late_ms: number;
let sender: SetpointSender;

beforeEach(() => {
  vi.useFakeTimers();
  [sent, asked, stopped, answers, late_ms] = [[], SETPOINT, [], true, 0];
  sender = new SetpointSender(
    {
      now: () => Date.now() + late_ms,
      nextSetpoint: () => asked,
      send: () => {
        sent.push(Date.now());
        const number = sent.length;
        if (answers) setTimeout(() => sender.answered(number), 5);
        return number;
      },
      onStop: (reason) => stopped.push(reason),
    },
    20,
  );
});

afterEach(() => {
  sender.stop();
  vi.useRealTimers();
});

describe("the sender", () => {
  it("sends at a steady rate from the first moment, whether a control is held or not", () => {
    const began = Date.now();
    sender.start();
    vi.advanceTimersByTime(1000);
    expect(sent.map((at) => at - began)).toEqual(Array.from({ length: 21 }, (_, i) => i * PERIOD_MS));
    expect(sender.answer_ms).toBe(5);
  });

  it("keeps to its grid after a late timer and makes up for nothing", () => {
    sender.start();
    late_ms = 130; // the clock went on, the timers did not
    vi.advanceTimersByTime(PERIOD_MS);
    expect(sent.length).toBe(2);
    vi.advanceTimersByTime(20);
    expect(sent.length).toBe(3); // 200 ms of the clock
    vi.advanceTimersByTime(PERIOD_MS);
    expect(sent.length).toBe(4);
  });

  it.each(["page_hidden", "window_blurred", "focus_lost", "no_input"] as const)(
    "stops when nobody is there (%s), says why, and never resumes by itself",
    (reason) => {
      sender.start();
      vi.advanceTimersByTime(100);
      const before = sent.length;
      asked = reason;
      vi.advanceTimersByTime(60);
      asked = SETPOINT;
      vi.advanceTimersByTime(5000);
      expect([sent.length - before, stopped, sender.sending]).toEqual([0, [reason], false]);
    },
  );

  it("stops when the page stood still: what was held then may not be held now", () => {
    sender.start();
    late_ms = 1200;
    vi.advanceTimersByTime(PERIOD_MS);
    expect([sent.length, stopped]).toEqual([1, ["page_stalled"]]);
  });

  it("holds back what would arrive late, and goes on with the newest when answers come again", () => {
    sender.start();
    vi.advanceTimersByTime(100);
    answers = false;
    vi.advanceTimersByTime(450);
    const waiting = sent.length;
    vi.advanceTimersByTime(300);
    expect(sent.length).toBeLessThanOrEqual(waiting + 2);
    const held = sent.length;
    answers = true;
    sender.answered(held);
    vi.advanceTimersByTime(200);
    expect(sent.length).toBe(held + 4);
    expect(stopped).toEqual([]);
  });

  it("stops when no answer comes any more", () => {
    answers = false;
    sender.start();
    vi.advanceTimersByTime(3000);
    expect(stopped).toEqual(["no_answer"]);
    expect(sent.length).toBe(8); // 0 to 350 ms
  });

  it("can be started anew, and forgets what was unanswered before", () => {
    answers = false;
    sender.start();
    vi.advanceTimersByTime(3000);
    answers = true;
    sender.start();
    sender.start(); // twice is once
    vi.advanceTimersByTime(100);
    expect([sent.length, stopped.length]).toEqual([11, 1]);
  });
});
