/** The files of a drop or a file dialogue, with those of folders. */
import type {DroppedFile} from '../model/scene_files';

export interface SceneFile extends DroppedFile {
  file: File;
}

const withPath = (file: File, path: string): SceneFile => ({file, path: path.replace(/^\/+/, ''), size: file.size});

async function filesBelow(entry: FileSystemEntry): Promise<SceneFile[]> {
  if (entry.isFile) {
    const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    return [withPath(file, entry.fullPath)];
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  const found: SceneFile[] = [];
  for (;;) {
    // Each call returns at most a hundred entries.
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) {
      return found;
    }
    for (const each of some) {
      found.push(...(await filesBelow(each)));
    }
  }
}

/** The event's content is valid only while it is handled, so this starts at once. */
export async function droppedFiles(transfer: DataTransfer): Promise<SceneFile[]> {
  const entries = [...transfer.items].map((item) => (item.kind === 'file' ? item.webkitGetAsEntry() : null));
  const plain = [...transfer.files];
  if (entries.every((entry) => entry === null)) {
    return plain.map((file) => withPath(file, file.name));
  }
  const found = await Promise.all(entries.map((entry) => (entry ? filesBelow(entry) : [])));
  return found.flat();
}

export function chosenFiles(list: FileList | null): SceneFile[] {
  return [...(list ?? [])].map((file) => withPath(file, file.webkitRelativePath || file.name));
}
