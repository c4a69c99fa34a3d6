import { useEffect, useState } from "preact/hooks";
import { api } from "../api/client";
import { asProblem } from "../api/problem";
import type { Attachment } from "../api/types";

/** A picture's file as an address for <img>: the token goes with a request of our own, which an <img> could not carry. */
export function useAttachedFile(run: string, attachment: Attachment, wanted: boolean): { readonly url: string | null; readonly problem: string } {
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
    api.attachmentFile(run, attachment).then(show, (error: unknown) => isWanted && setProblem(asProblem(error).message));
    return () => {
      isWanted = false;
      if (made !== null) URL.revokeObjectURL(made);
    };
  }, [run, attachment.sha256, wanted]);
  return { url, problem };
}
