import { useFocusBack } from "./use-focus-back";

/** A small button at the controls that its own press, or something else, takes away. */
export function PassingButton({ name, onClick }: { name: string; onClick: () => void }) {
  const ref = useFocusBack();
  return (
    <button type="button" class="small" ref={ref} onClick={onClick}>
      {name}
    </button>
  );
}
