/** Long enough for a browser that asks where to save, and for a slow disk. */
export const URL_LIFETIME_MS = 60_000;

/**
 * Saves a text or a blob as a file. The link is in the document while it is clicked, and its URL lives on after the
 * click: some browsers ignore a link that is not, and some begin to read only later.
 */
export function saveFile(name: string, content: BlobPart, type: string): void {
  const url = URL.createObjectURL(new Blob([content], { type }));
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), URL_LIFETIME_MS);
}
