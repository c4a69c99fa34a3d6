import { useEffect, useState } from "preact/hooks";
import { openFile } from "../state/plan-file";
import { showPanel } from "../state/selection";

/** A plan's file can be dropped anywhere on the page. */
export function FileDrop() {
  const [over, setOver] = useState(false);
  useEffect(() => {
    const hasFile = (event: DragEvent) => event.dataTransfer?.types.includes("Files") === true;
    const onOver = (event: DragEvent) => {
      if (!hasFile(event)) return;
      const taken = event.defaultPrevented; // by what it is held over, which takes files of its own
      event.preventDefault(); // else the browser leaves the page and opens the file
      setOver(!taken);
    };
    const onLeave = (event: DragEvent) => event.relatedTarget === null && setOver(false);
    const onDrop = (event: DragEvent) => {
      if (!hasFile(event)) return;
      setOver(false);
      if (event.defaultPrevented) return;
      event.preventDefault();
      showPanel("plan");
      void openFile(event.dataTransfer?.files[0]);
    };
    window.addEventListener("dragover", onOver);
    window.addEventListener("dragleave", onLeave);
    window.addEventListener("drop", onDrop);
    return () => {
      window.removeEventListener("dragover", onOver);
      window.removeEventListener("dragleave", onLeave);
      window.removeEventListener("drop", onDrop);
    };
  }, []);
  return over ? <div class="file-drop">Drop the plan here</div> : null;
}
