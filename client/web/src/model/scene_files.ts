/** Files that were dropped: which of them are scenes, what they name, and where what they name lies. Pure. */

const kScenes = /\.(json|gltf|glb)$/i;
const kMeshes = /\.obj$/i;
/** What scenes name: meshes, buffers, materials, images and photometry. */
const kParts = /\.(json|gltf|glb|obj|mtl|bin|png|jpe?g|exr|hdr|pic|tiff?|tga|bmp|gif|webp|ies)$/i;
/** Of these, what they name is read. */
const kTexts = /\.(json|gltf|obj|mtl)$/i;
/** Larger ones are not searched: what they name must lie where they say. */
export const kMostSearchedBytes = 64 * 1024 * 1024;
export const kMostFiles = 10_000;

/** How much of a file is searched: what an OBJ file names stands before its vertices. */
export function searchedBytes(path: string): number {
  return kMeshes.test(path) ? 1024 * 1024 : kMostSearchedBytes;
}

export interface DroppedFile {
  /** As the folder that was dropped has it, with '/'. */
  path: string;
  size: number;
}

export function isPart(path: string): boolean {
  return kParts.test(path) && !path.split('/').some((part) => part.startsWith('.'));
}

export function isSearched({path, size}: DroppedFile): boolean {
  return kTexts.test(path) && size <= kMostSearchedBytes;
}

/**
 * The choices of a scene; each is one file, or all meshes together where there is no other. Those that lie highest come first:
 * what lies deeper is more likely a part of them.
 */
export function sceneChoices(paths: readonly string[]): string[][] {
  const depth = (path: string) => path.split('/').length;
  const scenes = paths.filter((path) => kScenes.test(path)).sort((a, b) => depth(a) - depth(b) || (a < b ? -1 : 1));
  const meshes = paths.filter((path) => kMeshes.test(path)).sort();
  return scenes.length > 0 ? scenes.map((path) => [path]) : meshes.length > 0 ? [meshes] : [];
}

/** "a/b/../c" is "a/c"; undefined where it leads out of the folder. */
export function resolved(folder: string, name: string): string | undefined {
  const parts: string[] = [];
  for (const part of `${folder}/${name.replaceAll('\\', '/')}`.split('/')) {
    if (part === '..' && parts.pop() === undefined) {
      return undefined;
    }
    if (part !== '' && part !== '.' && part !== '..') {
      parts.push(part);
    }
  }
  return parts.join('/');
}

function jsonNames(text: string): string[] {
  return [...text.matchAll(/"(?:file|uri)"\s*:\s*("(?:[^"\\]|\\.)*")/g)].flatMap(([, quoted]) => {
    try {
      const name = JSON.parse(quoted!) as string;
      return name.startsWith('data:') ? [] : [name, decodeURIComponent(name)];
    } catch {
      return [];
    }
  });
}

/** What a file names, as it is written there. */
export function namesIn(path: string, text: string): string[] {
  if (/\.(json|gltf)$/i.test(path)) {
    return jsonNames(text);
  }
  const lines = /\.obj$/i.test(path) ? /^[ \t]*mtllib[ \t]+(.+?)[ \t]*\r?$/gim : /^[ \t]*(?:map_\w+|bump|disp|norm)[ \t]+(?:.*[ \t])?(\S+?)[ \t]*\r?$/gim;
  return [...text.matchAll(lines)].map(([, name]) => name!);
}

/**
 * Files that are named where they do not lie, as when some were chosen out of their folders: by the path that is named, the path of
 * the only file of that name. What two files could be is left alone.
 */
export function misplaced(paths: readonly string[], named: readonly {path: string; names: readonly string[]}[]): Map<string, string> {
  const base = (path: string) => path.slice(path.lastIndexOf('/') + 1).toLowerCase();
  const there = new Set(paths);
  const byName = new Map<string, string[]>();
  paths.forEach((path) => byName.set(base(path), [...(byName.get(base(path)) ?? []), path]));
  const found = new Map<string, string>();
  for (const {path, names} of named) {
    const folder = path.includes('/') ? path.slice(0, path.lastIndexOf('/')) : '';
    for (const name of names) {
      const wanted = resolved(folder, name);
      const only = wanted === undefined ? undefined : byName.get(base(wanted));
      if (wanted !== undefined && only?.length === 1 && !there.has(wanted)) {
        found.set(wanted, only[0]!);
      }
    }
  }
  return found;
}

/** "1.5 MB": thousands, as files are told of. */
export function humanBytes(bytes: number): string {
  const units = ['bytes', 'kB', 'MB', 'GB', 'TB'];
  let unit = 0;
  for (; bytes >= 999.5 && unit + 1 < units.length; bytes /= 1000) {
    ++unit;
  }
  return `${unit === 0 ? bytes : bytes < 9.95 ? bytes.toFixed(1) : Math.round(bytes)} ${units[unit]}`;
}
