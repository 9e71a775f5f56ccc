/** The files of what was dropped or chosen, folders and all. */
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
    // Each call brings a hundred at most.
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) {
      return found;
    }
    for (const each of some) {
      found.push(...(await filesBelow(each)));
    }
  }
}

/** What the event holds is there only while it is handled: this begins at once. */
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
