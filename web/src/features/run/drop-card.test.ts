import { expect, test } from "vitest";
import { sampleDrop } from "../../testing/samples";
import { pictureRadius, releaseOffset } from "./drop-card";

const POINT = { planned_latitude_deg: 47.4, planned_longitude_deg: 8.5 };

test("a release is told by how far east and north of the point it was", () => {
  const found = releaseOffset(sampleDrop({ ...POINT, latitude_deg: 47.4 + 3 / 111_195, longitude_deg: 8.5 }));
  expect(found?.north_m).toBeCloseTo(3, 6);
  expect(found?.east_m).toBe(0);
  const east = releaseOffset(sampleDrop({ ...POINT, latitude_deg: 47.4, longitude_deg: 8.5001 }));
  expect(east?.east_m).toBeCloseTo(7.526, 2);
});

test("nothing is drawn of a place that is not known", () => {
  expect([
    releaseOffset(sampleDrop(POINT)),
    releaseOffset(sampleDrop({ latitude_deg: 47.4, longitude_deg: 8.5 })),
  ]).toEqual([null, null]);
});

test("the picture holds the release and the allowance, in a round ring", () => {
  expect([
    pictureRadius({ east_m: 0.3, north_m: 0 }, 2),
    pictureRadius({ east_m: 3, north_m: 4 }, 2),
    pictureRadius({ east_m: 0, north_m: 0.1 }, null),
  ]).toEqual([5, 10, 2]);
});
