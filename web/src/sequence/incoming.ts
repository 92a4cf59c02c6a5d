/** The ways in: drop, button, folder, paste. Each gives files with their paths. */
import { byId } from '../app/dom.ts';
import type { SourceFile } from '../model/protocol.ts';

export function mountIncoming(receive: (files: SourceFile[]) => void): void {
  const [files, folder] = [byId<HTMLInputElement>('files'), byId<HTMLInputElement>('folder')];
  for (const input of [files, folder]) {
    input.addEventListener('change', () => {
      receive([...(input.files ?? [])].map((file) => ({ path: file.webkitRelativePath || file.name, blob: file })));
      input.value = '';
    });
  }
  for (const id of ['open', 'empty-open']) byId(id).addEventListener('click', () => files.click());
  byId('open-folder').addEventListener('click', () => folder.click());

  const zone = byId('drop');
  let depth = 0;
  const carriesFiles = (event: DragEvent) => event.dataTransfer?.types.includes('Files') ?? false;
  addEventListener('dragenter', (event) => {
    if (!carriesFiles(event)) return;
    depth += 1;
    zone.hidden = false;
  });
  addEventListener('dragleave', () => {
    depth = Math.max(0, depth - 1);
    zone.hidden = depth === 0;
  });
  addEventListener('dragover', (event) => carriesFiles(event) && event.preventDefault());
  addEventListener('drop', (event) => {
    depth = 0;
    zone.hidden = true;
    if (!event.dataTransfer || !carriesFiles(event)) return;
    event.preventDefault();
    void filesOf(event.dataTransfer).then(receive);
  });
  addEventListener('paste', (event) => {
    const pasted = [...(event.clipboardData?.files ?? [])];
    if (pasted.length > 0) receive(pasted.map((file) => ({ path: file.name, blob: file })));
  });
}

/** Every file of a drop, folders walked through. */
async function filesOf(transfer: DataTransfer): Promise<SourceFile[]> {
  // Entries must be taken before the first await: the list is emptied then.
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.() ?? null);
  const plain = [...transfer.files];
  if (entries.every((entry) => entry === null)) return plain.map((file) => ({ path: file.name, blob: file }));
  const found: SourceFile[] = [];
  for (const entry of entries) if (entry) await walk(entry, found);
  return found;
}

async function walk(entry: FileSystemEntry, found: SourceFile[]): Promise<void> {
  if (entry.isFile) {
    const file = await new Promise<File>((done, fail) => (entry as FileSystemFileEntry).file(done, fail));
    found.push({ path: entry.fullPath.replace(/^\//, ''), blob: file });
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  for (;;) {
    // A reader hands out at most a hundred entries a call.
    const some = await new Promise<FileSystemEntry[]>((done, fail) => reader.readEntries(done, fail));
    if (some.length === 0) return;
    for (const child of some) await walk(child, found);
  }
}
