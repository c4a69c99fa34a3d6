import { useEffect, useRef } from "preact/hooks";
import type { Attachment } from "../api/types";
import { bytes } from "../attachments/file";
import { fullTime } from "../format/units";
import { saveAttachment } from "./attachment-thumb";
import { Icon } from "./icons";
import { useAttachedFile } from "./use-attached-file";

/** A picture as large as the screen lets it be, with who attached it and its hash. Escape closes it. */
export function AttachmentView({ run, attachment, onClose }: { run: string; attachment: Attachment; onClose: () => void }) {
  const dialog = useRef<HTMLDialogElement>(null);
  const { url, problem } = useAttachedFile(run, attachment, true);
  useEffect(() => dialog.current?.showModal(), []);
  const { name, actor, at, size_bytes, sha256 } = attachment;
  return (
    <dialog ref={dialog} class="dialog picture-dialog" aria-label={name} onClose={onClose} onClick={(event) => event.target === dialog.current && dialog.current?.close()}>
      <figure>
        {url === null ? <p role="status">{problem === "" ? "Reading the picture…" : problem}</p> : <img src={url} alt={name} />}
        <figcaption>
          <b>{name}</b>
          <small>
            {bytes(size_bytes)} · attached by {actor}, {fullTime(at)}
          </small>
          <small class="hash">SHA-256 {sha256}</small>
        </figcaption>
      </figure>
      <div class="actions">
        <button type="button" class="small" onClick={() => void saveAttachment(run, attachment)}>
          <Icon name="save" size={15} /> Save
        </button>
        <button type="button" class="small" onClick={() => dialog.current?.close()}>
          <Icon name="close" size={15} /> Close
        </button>
      </div>
    </dialog>
  );
}
