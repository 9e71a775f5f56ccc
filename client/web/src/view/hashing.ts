/** SHA-256 of files, one after the other, in a web worker. */

export interface HashQuestion {
  file: Blob;
}
export type HashAnswer = {digest: Uint8Array; failure?: undefined} | {digest?: undefined; failure: string};

/** Why this browser cannot hash; undefined if it can. */
export function hashingRefused(): string | undefined {
  return globalThis.crypto?.subtle
    ? undefined
    : 'Browsers hash files only on encrypted pages and on localhost. Open this page over https or through a tunnel to localhost, or use "lightmill submit".';
}

export class Hasher {
  private readonly worker = new Worker(new URL('./hash_worker.ts', import.meta.url), {type: 'module'});

  hash(name: string, file: Blob, signal: AbortSignal): Promise<Uint8Array> {
    return new Promise((resolve, reject) => {
      const stop = () => reject(new DOMException('stopped', 'AbortError'));
      signal.addEventListener('abort', stop, {once: true});
      this.worker.onmessage = ({data}: MessageEvent<HashAnswer>) => {
        signal.removeEventListener('abort', stop);
        data.digest ? resolve(data.digest) : reject(new Error(`${name} cannot be read (${data.failure}): drop it again`));
      };
      this.worker.onerror = () => reject(new Error('the worker that hashes files could not be loaded: reload the page'));
      this.worker.postMessage({file} satisfies HashQuestion);
    });
  }

  close(): void {
    this.worker.terminate();
  }
}
