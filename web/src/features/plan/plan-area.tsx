import type { Finding } from "../../api/types";
import { FindingNote } from "../../ui/finding-note";
import { Icon } from "../../ui/icons";
import { findings } from "./draft";
import { draftPlan, editPlan } from "./draft-text";
import { activeTool, chooseTool, type Tool } from "./map-editor";
import { isRecord, valueAt, withValue } from "./pointer";
import { planSchema, type Shape, shapeFields } from "./schema";
import { SchemaFields } from "./schema-fields";

/** Where the vehicle may fly, where it may not, and where it may return to. */
export function PlanArea() {
  const plan = draftPlan.value;
  if (plan === null) return null;
  const list = (pointer: string) => {
    const found = valueAt(plan, pointer);
    return Array.isArray(found) ? found : [];
  };
  const empty = ["/geofence/polygons", "/geofence/circles", "/rally_points"].every(
    (pointer) => list(pointer).length === 0,
  );
  return (
    <div class="plan-area">
      <div class="area-tools">
        <Draw name="fence" text="Fence" />
        <Draw name="fence-circle" text="Circular fence" />
        <Draw name="keep-out" text="Keep-out" />
        <Draw name="keep-out-circle" text="Circular keep-out" />
        <Draw name="rally" text="Rally point" />
      </div>
      {empty && (
        <p class="muted">
          No fence: the vehicle may fly anywhere. Select a shape and draw it on the map. With the keyboard, Space adds a
          point at the centre of the map.
        </p>
      )}
      {list("/geofence/polygons").map((value, i) => (
        <ShapeCard
          key={i}
          shape="FencePolygon"
          title={`${kindName(value)}, ${corners(value).length} corners`}
          pointer={`/geofence/polygons/${i}`}
          value={value}
        />
      ))}
      {list("/geofence/circles").map((value, i) => (
        <ShapeCard
          key={i}
          shape="FenceCircle"
          title={`${kindName(value)}, circular`}
          pointer={`/geofence/circles/${i}`}
          value={value}
        />
      ))}
      {list("/rally_points").map((value, i) => (
        <ShapeCard
          key={i}
          shape="RallyPoint"
          title={`Rally point ${i + 1}`}
          pointer={`/rally_points/${i}`}
          value={value}
        />
      ))}
    </div>
  );
}

function Draw({ name, text }: { name: Tool; text: string }) {
  const inHand = activeTool.value === name;
  return (
    <button type="button" class="small" aria-pressed={inHand} onClick={() => chooseTool(inHand ? null : name)}>
      <Icon name="plus" size={14} />
      {text}
    </button>
  );
}

interface CardProps {
  shape: Shape;
  title: string;
  pointer: string;
  value: unknown;
}

function ShapeCard({ shape, title, pointer, value }: CardProps) {
  const schema = planSchema.value;
  const about = findings.value.filter((finding) => isAbout(finding, pointer));
  return (
    <section class="area-card" aria-label={title}>
      <header>
        <b>{title}</b>
        <button
          type="button"
          class="icon-button"
          aria-label={`Delete: ${title}`}
          onClick={() => editPlan((plan) => withValue(plan, pointer, undefined))}
        >
          <Icon name="trash" size={16} />
        </button>
      </header>
      {schema !== null && (
        <SchemaFields
          fields={shapeFields(schema, shape).filter((field) => field.control.kind !== "none")}
          pointer={pointer}
          value={value}
        />
      )}
      {schema !== null && shape === "FencePolygon" && (
        <details>
          <summary>Corners</summary>
          {corners(value).map((corner, i) => (
            <div key={i} class="corner" role="group" aria-label={`Corner ${i + 1}`}>
              <SchemaFields fields={shapeFields(schema, "Point")} pointer={`${pointer}/vertices/${i}`} value={corner} />
              <button
                type="button"
                class="icon-button"
                aria-label={`Delete corner ${i + 1}`}
                disabled={corners(value).length <= 3}
                onClick={() => editPlan((plan) => withValue(plan, `${pointer}/vertices/${i}`, undefined))}
              >
                <Icon name="close" size={14} />
              </button>
            </div>
          ))}
        </details>
      )}
      {about.map((finding) => (
        <FindingNote key={finding.code + finding.pointer} finding={finding} />
      ))}
    </section>
  );
}

function isAbout(finding: Finding, pointer: string): boolean {
  return finding.pointer === pointer || finding.pointer.startsWith(`${pointer}/`);
}

function kindName(value: unknown): string {
  return isRecord(value) && value["kind"] === "exclusion" ? "Keep-out" : "Fence";
}

function corners(value: unknown): readonly unknown[] {
  return isRecord(value) && Array.isArray(value["vertices"]) ? value["vertices"] : [];
}
