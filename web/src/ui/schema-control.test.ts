import { describe, expect, it } from "vitest";
import { controlOf, fieldsOf, labelAndUnit } from "./schema-control";

describe("the control of a schema", () => {
  it("follows its type", () => {
    expect(controlOf({ type: "boolean" })).toEqual({ kind: "switch" });
    expect(controlOf({ type: "boolean", const: true })).toEqual({ kind: "once", value: true });
    expect(controlOf({ type: "string", enum: ["a", "b"] })).toEqual({ kind: "choice", options: ["a", "b"] });
    expect(controlOf({ type: "integer", minimum: 0, maximum: 15 })).toEqual({
      kind: "number",
      integer: true,
      range: "0 to 15",
    });
    expect(controlOf({ type: "number", exclusiveMinimum: 0 })).toEqual({
      kind: "number",
      integer: false,
      range: "above 0",
    });
  });

  it("names the parts of a tuple by their titles", () => {
    const wind = {
      type: "array",
      prefixItems: [
        { type: "number", title: "north" },
        { type: "number", title: "east" },
      ],
    };
    expect(controlOf(wind)).toMatchObject({
      kind: "tuple",
      names: ["north", "east"],
      parts: [{ kind: "number" }, { kind: "number" }],
    });
    expect(controlOf({ ...wind, prefixItems: [{ type: "number" }, { type: "number" }] })).toMatchObject({
      names: ["1", "2"],
    });
  });

  it("is none for what it does not know, so that no wrong control is shown", () => {
    expect(controlOf({})).toEqual({ kind: "none" });
    expect(controlOf({ anyOf: [{ type: "string" }, { type: "number" }] })).toEqual({ kind: "none" });
    expect(controlOf({ $ref: "#/$defs/Missing" })).toEqual({ kind: "none" });
  });
});

describe("the fields of an object", () => {
  const root = {
    $defs: { Home: { type: "object", required: ["latitude_deg"], properties: { latitude_deg: { type: "number" } } } },
    type: "object",
    required: ["name"],
    properties: {
      name: { type: "string", maxLength: 200 },
      hold_s: { type: "number", default: 30, description: "how long" },
      yaw_deg: { anyOf: [{ type: "number", description: "from north" }, { type: "null" }], default: null },
      home: { anyOf: [{ $ref: "#/$defs/Home" }, { type: "null" }], default: null },
    },
  };

  it("carry label, unit, help, default and whether they must be given", () => {
    const [name, hold, yaw] = fieldsOf(root);
    expect(name).toMatchObject({ label: "Name", unit: "", required: true, fallback: undefined });
    expect(hold).toMatchObject({ label: "Hold", unit: "s", required: false, fallback: 30, help: "how long" });
    expect(yaw).toMatchObject({ unit: "°", help: "from north", fallback: undefined, control: { kind: "number" } });
  });

  it("follow references", () => {
    expect(fieldsOf(root)[3]?.control).toMatchObject({
      kind: "object",
      fields: [{ name: "latitude_deg", required: true }],
    });
  });

  it("take their unit from the end of their name", () => {
    expect(labelAndUnit("speed_m_s")).toEqual({ label: "Speed", unit: "m/s" });
    expect(labelAndUnit("max_offset_m")).toEqual({ label: "Max offset", unit: "m" });
    expect(labelAndUnit("battery_percent")).toEqual({ label: "Battery", unit: "%" });
    expect(labelAndUnit("gps_loss").label).toBe("GPS loss");
    expect(labelAndUnit("turns")).toEqual({ label: "Turns", unit: "" });
  });
});
