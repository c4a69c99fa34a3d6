import { selectVehicle } from "../state/selection";
import { vehicleIds } from "../state/store";
import { Choice } from "./choice";
import { Icon } from "./icons";

/** On a narrow page neither the fleet nor the map is beside this panel: the vehicle is chosen here too. */
export function OffboardNoVehicle() {
  const ids = vehicleIds.value;
  return (
    <div class="panel-body empty-panel">
      <Icon name="joystick" size={40} />
      <h3>No vehicle chosen</h3>
      {ids.length === 0 ? (
        <p>No vehicle has been seen yet.</p>
      ) : (
        <>
          <p>Choose the vehicle to control, here, in the fleet or on the map.</p>
          <Choice name="Vehicle to fly" value="" onChange={selectVehicle}>
            <option value="" disabled>
              Choose…
            </option>
            {ids.map((id) => (
              <option key={id} value={id}>
                {id}
              </option>
            ))}
          </Choice>
        </>
      )}
    </div>
  );
}
