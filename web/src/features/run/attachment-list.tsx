import { useComputed } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { api } from "../../api/client";
import { toProblem } from "../../api/problem";
import type { Attachment } from "../../api/types";
import { formatMoment, formatTimestamp } from "../../format/units";
import { reportProblem } from "../../store/notices";
import { hasRole } from "../../store/principal";
import { live, today } from "../../store/store";
import { Icon } from "../../ui/icons";
import { saveFile } from "../../ui/save-file";
import {
  ACCEPTED_TYPES,
  attach,
  attachmentsOf,
  formatBytes,
  isPicture,
  loadAttachments,
  newestAttachment,
} from "./attachments";

/**
 * Photos, signatures and documents of one drop: what is there, and a way to add to it by button or by dropping a file.
 */
export function DropAttachments({ run, drop }: { run: string; drop: string }) {
  const [over, setOver] = useState(false);
  const [shown, setShown] = useState<Attachment | null>(null);
  const newest = useComputed(() => newestAttachment(run, drop)).value;
  const group = useRef<HTMLDivElement>(null);
  const seen = useSeen(group);
  useEffect(() => {
    if (seen) void loadAttachments(run, drop);
  }, [run, drop, newest, live.value, seen]);
  const { list, sending, loadProblem, problems } = attachmentsOf(run, drop);
  const mayAttach = live.value && hasRole("dispatcher");
  const onDrop = (event: DragEvent) => {
    event.preventDefault(); // and the page does not take it for a plan
    setOver(false);
    if (mayAttach) void attach(run, drop, [...(event.dataTransfer?.files ?? [])]);
  };
  return (
    <div
      ref={group}
      class={`attachments${over ? " over" : ""}`}
      role="group"
      aria-label={`Attachments of ${drop}`}
      onDragOver={(event) => {
        event.preventDefault();
        setOver(true);
      }}
      onDragLeave={() => setOver(false)}
      onDrop={onDrop}
    >
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
      {[loadProblem, ...problems]
        .filter((problem) => problem !== "")
        .map((problem) => (
          <p key={problem} class="attach-problem" role="alert">
            {problem}
          </p>
        ))}
      {hasRole("dispatcher") && (
        <Picker drop={drop} disabled={!mayAttach} onFiles={(files) => void attach(run, drop, files)} />
      )}
      {shown !== null && isPicture(shown) && (
        <AttachmentView run={run} attachment={shown} onClose={() => setShown(null)} />
      )}
    </div>
  );
}

function Picker({
  drop,
  disabled,
  onFiles,
}: {
  drop: string;
  disabled: boolean;
  onFiles: (files: readonly File[]) => void;
}) {
  const input = useRef<HTMLInputElement>(null);
  const pick = (event: Event & { currentTarget: HTMLInputElement }) => {
    const files = [...(event.currentTarget.files ?? [])];
    event.currentTarget.value = ""; // the same file can be picked again
    if (files.length > 0) onFiles(files);
  };
  return (
    <>
      <button
        type="button"
        class="small"
        disabled={disabled}
        title="JPEG, PNG or PDF up to 8 MiB. You can also drop files here."
        onClick={() => input.current?.click()}
      >
        <Icon name="attach" size={15} /> Attach a photo, signature or PDF
        <span class="visually-hidden"> to {drop}</span>
      </button>
      <input type="file" hidden multiple accept={ACCEPTED_TYPES.join(",")} ref={input} onChange={pick} />
    </>
  );
}

interface Props {
  run: string;
  attachment: Attachment;
  onShow: () => void;
}

/** One attachment: a picture is shown small and opens large, a document is saved. */
function AttachmentThumb({ run, attachment, onShow }: Props) {
  const button = useRef<HTMLButtonElement>(null);
  const seen = useSeen(button);
  const picture = isPicture(attachment);
  const { url, problem } = useAttachedFile(run, attachment, picture && seen);
  const { name, actor, at, size_bytes } = attachment;
  return (
    <button
      type="button"
      class="attachment"
      ref={button}
      title={`${name}, ${formatBytes(size_bytes)}, by ${actor}, ${formatTimestamp(at)}`}
      onClick={picture ? onShow : () => void saveAttachment(run, attachment)}
    >
      <span class="attachment-picture">
        {url === null ? <Icon name={problem === "" ? "file" : "error"} size={26} /> : <img src={url} alt="" />}
      </span>
      <span class="attachment-name">
        <span class="visually-hidden">{picture ? "Show" : "Save"} </span>
        {name}
      </span>
      <small>{problem === "" ? `${actor} · ${formatMoment(at, today.value)}` : problem}</small>
    </button>
  );
}

async function saveAttachment(run: string, attachment: Attachment): Promise<void> {
  try {
    saveFile(attachment.name, await api.attachmentFile(run, attachment), attachment.media_type);
  } catch (error) {
    reportProblem(`Save ${attachment.name}`, error);
  }
}

/** Whether it was ever on the screen: a run may have hundreds of drops, and photos have megabytes. */
function useSeen(ref: { readonly current: Element | null }): boolean {
  const [seen, setSeen] = useState(false);
  useEffect(() => {
    if (seen || ref.current === null) return undefined;
    const watch = new IntersectionObserver(
      (entries) => entries.some(({ isIntersecting }) => isIntersecting) && setSeen(true),
    );
    watch.observe(ref.current);
    return () => watch.disconnect();
  }, [seen]);
  return seen;
}

/** A picture as large as the screen lets it be, with who attached it and its hash. Escape closes it. */
function AttachmentView({ run, attachment, onClose }: { run: string; attachment: Attachment; onClose: () => void }) {
  const dialog = useRef<HTMLDialogElement>(null);
  const { url, problem } = useAttachedFile(run, attachment, true);
  useEffect(() => dialog.current?.showModal(), []);
  const { name, actor, at, size_bytes, sha256 } = attachment;
  return (
    // biome-ignore lint/a11y/useKeyWithClickEvents: Escape closes a dialog by itself
    <dialog
      ref={dialog}
      class="dialog picture-dialog"
      aria-label={name}
      onClose={onClose}
      onClick={(event) => event.target === dialog.current && dialog.current?.close()}
    >
      <figure>
        {url === null ? (
          <p role="status">{problem === "" ? "Loading the picture…" : problem}</p>
        ) : (
          <img src={url} alt={name} />
        )}
        <figcaption>
          <b>{name}</b>
          <small>
            {formatBytes(size_bytes)} · attached by {actor}, {formatTimestamp(at)}
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

/**
 * A picture's file as an address for <img>: the token goes with a request of our own, which an <img> could not carry.
 */
function useAttachedFile(
  run: string,
  attachment: Attachment,
  wanted: boolean,
): { readonly url: string | null; readonly problem: string } {
  const [url, setUrl] = useState<string | null>(null);
  const [problem, setProblem] = useState("");
  useEffect(() => {
    if (!wanted) return undefined;
    let made: string | null = null;
    let isWanted = true;
    const show = (file: Blob) => {
      if (!isWanted) return;
      made = URL.createObjectURL(new Blob([file], { type: attachment.media_type }));
      setUrl(made);
    };
    api
      .attachmentFile(run, attachment)
      .then(show, (error: unknown) => isWanted && setProblem(toProblem(error).message));
    return () => {
      isWanted = false;
      if (made !== null) URL.revokeObjectURL(made);
    };
  }, [run, attachment.sha256, wanted]);
  return { url, problem };
}
