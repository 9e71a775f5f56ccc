/** Dropped files: which are scenes, which files they name, and where these lie. Pure. */

const kScenes = /\.(json|gltf|glb|pbrt|xml)$/i;
const kMeshes = /\.obj$/i;
/** Meshes that are scenes if there is nothing else. Scenes name such files, too. */
const kSingleMeshes = /\.(ply|stl)$/i;
/** Kinds of files that scenes name: meshes, buffers, materials, images and photometry. */
const kParts = /\.(json|gltf|glb|obj|mtl|pbrt|xml|ply|stl|serialized|spd|bin|png|jpe?g|exr|hdr|pic|tiff?|tga|bmp|gif|webp|ies)$/i;
/** The kinds whose content names further files. */
const kTexts = /\.(json|gltf|obj|mtl|pbrt|xml)$/i;
/** Larger files are not searched. The files that they name must be at the named paths. */
export const kMaxSearchedBytes = 64 * 1024 * 1024;
export const kMaxFiles = 10_000;

/** Bytes of a file that are searched. An OBJ file names other files before its vertices. */
export function searchedBytes(path: string): number {
  return kMeshes.test(path) ? 1024 * 1024 : kMaxSearchedBytes;
}

export interface DroppedFile {
  /** The path in the dropped folder, with '/'. */
  path: string;
  size: number;
}

export function isPart(path: string): boolean {
  return kParts.test(path) && !path.split('/').some((part) => part.startsWith('.'));
}

export function isSearched({path, size}: DroppedFile): boolean {
  return kTexts.test(path) && size <= kMaxSearchedBytes;
}

/**
 * The choices of a scene: each is one file, or all OBJ files together, or a mesh, if there is nothing else. Files nearest to the top come first, because
 * deeper ones are more likely parts of them.
 */
export function sceneChoices(paths: readonly string[]): string[][] {
  const depth = (path: string) => path.split('/').length;
  const scenes = paths.filter((path) => kScenes.test(path)).sort((a, b) => depth(a) - depth(b) || (a < b ? -1 : 1));
  const meshes = paths.filter((path) => kMeshes.test(path)).sort();
  const single = paths.filter((path) => kSingleMeshes.test(path)).sort();
  return scenes.length > 0 ? scenes.map((path) => [path]) : meshes.length > 0 ? [meshes] : single.map((path) => [path]);
}

/** "a/b/../c" is "a/c"; undefined if it leads out of the folder. */
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

/** The paths in a file, as written. */
export function namesIn(path: string, text: string): string[] {
  if (/\.(json|gltf)$/i.test(path)) {
    return jsonNames(text);
  }
  if (/\.pbrt$/i.test(path)) {
    return [...text.matchAll(/(?:\b(?:Include|Import)|"(?:string|spectrum)[ \t]+[\w.]+")\s*\[?\s*"([^"\n]+)"/g)].map(([, name]) => name!);
  }
  if (/\.xml$/i.test(path)) {
    return [...text.matchAll(/(?:\bname\s*=\s*["']filename["']\s+value|\bfilename)\s*=\s*["']([^"']+)["']/g)].map(([, name]) => name!);
  }
  const lines = /\.obj$/i.test(path) ? /^[ \t]*mtllib[ \t]+(.+?)[ \t]*\r?$/gim : /^[ \t]*(?:map_\w+|bump|disp|norm)[ \t]+(?:.*[ \t])?(\S+?)[ \t]*\r?$/gim;
  return [...text.matchAll(lines)].map(([, name]) => name!);
}

/**
 * Maps a named path without a file to the only file of that name, as when files were chosen without their folders. Ambiguous names are left
 * out.
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

/** "1.5 MB": powers of 1000, as usual for files. */
export function humanBytes(bytes: number): string {
  const units = ['bytes', 'kB', 'MB', 'GB', 'TB'];
  let unit = 0;
  for (; bytes >= 999.5 && unit + 1 < units.length; bytes /= 1000) {
    ++unit;
  }
  return `${unit === 0 ? bytes : bytes < 9.95 ? bytes.toFixed(1) : Math.round(bytes)} ${units[unit]}`;
}
