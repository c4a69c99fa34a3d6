import { useEffect, useRef, useState } from "preact/hooks";
import { api } from "../api/client";
import type { Attachment } from "../api/types";
import { bytes, isPicture } from "../attachments/file";
import { clockTime, fullTime } from "../format/units";
import { report } from "../state/notices";
import { saveFile } from "../state/save-file";
import { Icon } from "./icons";
import { useAttachedFile } from "./use-attached-file";

interface Props {
  run: string;
  attachment: Attachment;
  onShow: () => void;
}

/** One attachment: a picture is shown small and opens large, a document is saved. */
export function AttachmentThumb({ run, attachment, onShow }: Props) {
  const button = useRef<HTMLButtonElement>(null);
  const seen = useSeen(button);
  const picture = isPicture(attachment);
  const { url, problem } = useAttachedFile(run, attachment, picture && seen);
  const { name, actor, at, size_bytes } = attachment;
  return (
    <button type="button" class="attachment" ref={button} title={`${name}, ${bytes(size_bytes)}, by ${actor}, ${fullTime(at)}`} onClick={picture ? onShow : () => void saveAttachment(run, attachment)}>
      <span class="attachment-picture">{url === null ? <Icon name={problem === "" ? "file" : "error"} size={26} /> : <img src={url} alt="" />}</span>
      <span class="attachment-name">
        <span class="visually-hidden">{picture ? "Show" : "Save"} </span>
        {name}
      </span>
      <small>{problem === "" ? `${actor} · ${clockTime(at)}` : problem}</small>
    </button>
  );
}

export async function saveAttachment(run: string, attachment: Attachment): Promise<void> {
  try {
    saveFile(attachment.name, await api.attachmentFile(run, attachment), attachment.media_type);
  } catch (error) {
    report(`Save ${attachment.name}`, error);
  }
}

/** Whether it was ever on the screen: a photo has megabytes, and nobody may ever scroll there. */
function useSeen(ref: { readonly current: Element | null }): boolean {
  const [seen, setSeen] = useState(false);
  useEffect(() => {
    if (seen || ref.current === null) return undefined;
    const watch = new IntersectionObserver((entries) => entries.some(({ isIntersecting }) => isIntersecting) && setSeen(true));
    watch.observe(ref.current);
    return () => watch.disconnect();
  }, [seen]);
  return seen;
}
