import { expect, test } from "vitest";
import { coarseWorld } from "./coarse-world.ts";

test("the world that ships with the page is what its generator makes of the package", async () => {
  await expect(coarseWorld()).toMatchFileSnapshot("../src/features/map/world.json");
});
