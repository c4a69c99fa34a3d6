import { useFocusBack } from "./use-focus-back";

interface Props {
  name: string;
  look?: "small" | "primary";
  /** Does nothing now. It can still have the focus: a button that is really disabled would lose it. */
  off?: boolean;
  onClick: () => void;
}

/** A button at the controls that its own press, or something else, takes away. */
export function PassingButton({ name, look = "small", off = false, onClick }: Props) {
  const ref = useFocusBack();
  return (
    <button type="button" class={look} aria-disabled={off || undefined} ref={ref} onClick={() => !off && onClick()}>
      {name}
    </button>
  );
}
