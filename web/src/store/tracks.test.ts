import { expect, it } from "vitest";
import { sampleState } from "../testing/samples";
import { extendTracks, type Tracks, trackLines } from "./tracks";

const METRE_DEG = 1 / 111_195;

function flown(...points: [north_m: number, time: number][]): Tracks {
  return points.reduce<Tracks>(
    (tracks, [north, time]) =>
      extendTracks(tracks, { v1: sampleState({ latitude_deg: 47 + north * METRE_DEG }) }, time),
    {},
  );
}

it("a track grows with the vehicle", () => {
  expect(trackLines(flown([0, 0], [5, 1], [10, 2])["v1"] ?? [])[0]?.length).toBe(3);
});

it("a vehicle that stands still adds nothing, and nothing is drawn anew for it", () => {
  const before = flown([0, 0], [5, 1]);
  expect(extendTracks(before, { v1: sampleState({ latitude_deg: 47 + 5.2 * METRE_DEG }) }, 2)).toBe(before);
});

it("a silence is a break and no straight line", () => {
  expect(trackLines(flown([0, 0], [5, 1], [300, 60], [305, 61])["v1"] ?? []).length).toBe(2);
});

it("a position that is not known or too old is not drawn", () => {
  expect(extendTracks({}, { v1: sampleState({ latitude_deg: null }) }, 0)).toEqual({});
  expect(extendTracks({}, { v1: sampleState({ position_age_s: 30 }) }, 0)).toEqual({});
});

it("many tracks together are bounded too", () => {
  const fleet = (i: number) =>
    Object.fromEntries(
      Array.from({ length: 200 }, (_, n) => [`v${n}`, sampleState({ latitude_deg: 47 + i * 5 * METRE_DEG })]),
    );
  let tracks: Tracks = {};
  for (let i = 0; i < 300; i++) tracks = extendTracks(tracks, fleet(i), i);
  expect(Object.values(tracks).reduce((sum, track) => sum + track.length, 0)).toBeLessThanOrEqual(12_000);
});

it("tails of a large fleet are coarser, so that they are not shorter than what they follow is wide", () => {
  const fleet = (count: number, north_m: number) =>
    Object.fromEntries(
      Array.from({ length: count }, (_, n) => [`v${n}`, sampleState({ latitude_deg: 47 + north_m * METRE_DEG })]),
    );
  const length = (count: number) => {
    let tracks: Tracks = {};
    for (let i = 0; i < 20; i++) tracks = extendTracks(tracks, fleet(count, i * 2), i);
    return tracks["v0"]?.length;
  };
  expect([length(2), length(200)]).toEqual([20, 7]); // each 2 m, and each 6 m
});

it("a track is bounded", () => {
  const points = Array.from({ length: 2000 }, (_, i): [number, number] => [i * 5, i]);
  expect(flown(...points)["v1"]?.length).toBe(600);
});
