/** The upload of files: hashing, asking which are missing, sending those, and inspection by a worker. */
import {findMissing, uploadAsset} from '../api/assets';
import {inspectScene, type Inspection, type NamedDigest} from '../api/inspect';
import {hexOf} from '../model/bytes';
import {isPart, isSearched, kMaxFiles, misplaced, namesIn, sceneChoices, searchedBytes} from '../model/scene_files';
import type {SceneFile} from './dropped';
import {Hasher, hashingRefused} from './hashing';

export interface Progress {
  what: string;
  /** Bytes; undefined if unknown. */
  done?: number;
  total?: number;
}

/** The files that the farm has and can inspect. */
export interface Sent {
  files: NamedDigest[];
  choices: string[][];
  /** Number of files that are no part of any scene. */
  leftOut: number;
}

async function hashAll(files: readonly SceneFile[], onProgress: (progress: Progress) => void, signal: AbortSignal): Promise<Uint8Array[]> {
  const total = files.reduce((sum, {size}) => sum + size, 0);
  const hasher = new Hasher();
  const digests: Uint8Array[] = [];
  let done = 0;
  try {
    for (const {path, file, size} of files) {
      onProgress({what: `Hashing ${path}`, done, total});
      digests.push(await hasher.hash(path, file, signal));
      done += size;
    }
    return digests;
  } finally {
    hasher.close();
  }
}

async function uploadMissing(files: readonly SceneFile[], digests: readonly Uint8Array[], onProgress: (progress: Progress) => void, signal: AbortSignal): Promise<void> {
  onProgress({what: 'Checking which files the farm lacks'});
  const missing = await findMissing(digests, signal);
  const names = digests.map(hexOf);
  const waiting = files.map((file, i) => ({file, digest: names[i]!})).filter(({digest}, i) => missing.has(digest) && names.indexOf(digest) === i);
  const total = waiting.reduce((sum, {file}) => sum + file.size, 0);
  let done = 0;
  for (const {file, digest} of waiting) {
    const tell = (sent: number) => onProgress({what: `Sending ${file.path}`, done: done + Math.min(sent, file.size), total});
    tell(0);
    await uploadAsset(digest, file.file, tell, signal).catch((error: unknown) => {
      throw error instanceof DOMException ? error : new Error(`${file.path}: ${error instanceof Error ? error.message : String(error)}`);
    });
    done += file.size;
  }
}

export async function sendFiles(dropped: readonly SceneFile[], onProgress: (progress: Progress) => void, signal: AbortSignal): Promise<Sent> {
  const refused = hashingRefused();
  if (refused) {
    throw new Error(refused);
  }
  const files = dropped.filter(({path}) => isPart(path));
  const choices = sceneChoices(files.map(({path}) => path));
  if (choices.length === 0) {
    throw new Error('None of these files is a scene: drop a .json, .gltf, .glb, .pbrt, .xml, .obj, .ply or .stl file, with the files that it names or the folder that holds all of them.');
  }
  if (files.length > kMaxFiles) {
    throw new Error(`${files.length} files are too many (limit ${kMaxFiles}): drop the scene's own folder.`);
  }
  const digests = await hashAll(files, onProgress, signal);
  await uploadMissing(files, digests, onProgress, signal);
  onProgress({what: 'Searching for the files that the scene names'});
  const named: {path: string; names: string[]}[] = [];
  for (const {path, file} of files.filter(isSearched)) {
    signal.throwIfAborted();
    named.push({path, names: namesIn(path, await file.slice(0, searchedBytes(path)).text())});
  }
  const byPath = new Map(files.map(({path}, i) => [path, digests[i]!]));
  for (const [path, from] of misplaced([...byPath.keys()], named)) {
    byPath.set(path, byPath.get(from)!);
  }
  return {files: [...byPath].map(([path, digest]) => ({path, digest})), choices, leftOut: dropped.length - files.length};
}

export function inspect(sent: Sent, scene: readonly string[], camera: string, signal: AbortSignal): Promise<Inspection> {
  return inspectScene(sent.files, scene, camera, signal);
}
