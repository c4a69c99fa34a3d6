import { useComputed } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import type { Attachment } from "../api/types";
import { isPicture, TAKEN } from "../attachments/file";
import { attach, attachedTo, newestAttachment, readAttachments } from "../state/attachments";
import { may } from "../state/principal";
import { live } from "../state/store";
import { AttachmentThumb } from "./attachment-thumb";
import { AttachmentView } from "./attachment-view";
import { Icon } from "./icons";

/** Photos, signatures and documents of one drop: what is there, and a way to add to it by button or by dropping a file. */
export function DropAttachments({ run, drop }: { run: string; drop: string }) {
  const [over, setOver] = useState(false);
  const [shown, setShown] = useState<Attachment | null>(null);
  const newest = useComputed(() => newestAttachment(run, drop)).value;
  useEffect(() => void readAttachments(run, drop), [run, drop, newest, live.value]);
  const { list, sending, problems } = attachedTo(run, drop);
  const mayAttach = live.value && may("dispatcher");
  const onDrop = (event: DragEvent) => {
    event.preventDefault(); // and the page does not take it for a plan
    setOver(false);
    if (mayAttach) void attach(run, drop, [...(event.dataTransfer?.files ?? [])]);
  };
  return (
    <div class={`attachments${over ? " over" : ""}`} role="group" aria-label={`Attachments of ${drop}`} onDragOver={(event) => (event.preventDefault(), setOver(true))} onDragLeave={() => setOver(false)} onDrop={onDrop}>
      {list !== null && list.length > 0 && (
        <ul>
          {list.map((attachment) => (
            <li key={attachment.sha256}>
              <AttachmentThumb run={run} attachment={attachment} onShow={() => setShown(attachment)} />
            </li>
          ))}
        </ul>
      )}
      {sending.map((name) => (
        <p key={name} class="attaching" role="status">
          Sending “{name}”…
        </p>
      ))}
      {problems.map((problem) => (
        <p key={problem} class="attach-problem" role="alert">
          {problem}
        </p>
      ))}
      {may("dispatcher") && <Picker drop={drop} disabled={!mayAttach} onFiles={(files) => void attach(run, drop, files)} />}
      {shown !== null && isPicture(shown) && <AttachmentView run={run} attachment={shown} onClose={() => setShown(null)} />}
    </div>
  );
}

function Picker({ drop, disabled, onFiles }: { drop: string; disabled: boolean; onFiles: (files: readonly File[]) => void }) {
  const input = useRef<HTMLInputElement>(null);
  const pick = (event: Event & { currentTarget: HTMLInputElement }) => {
    const files = [...(event.currentTarget.files ?? [])];
    event.currentTarget.value = ""; // the same file can be picked again
    if (files.length > 0) onFiles(files);
  };
  return (
    <>
      <button type="button" class="small" disabled={disabled} title="JPEG, PNG or PDF, at most 8 MiB; or drop it here" onClick={() => input.current?.click()}>
        <Icon name="attach" size={15} /> Attach a photo, signature or PDF
        <span class="visually-hidden"> to {drop}</span>
      </button>
      <input type="file" hidden multiple accept={TAKEN.join(",")} ref={input} onChange={pick} />
    </>
  );
}
