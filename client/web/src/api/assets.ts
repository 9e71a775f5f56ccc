/** Uploads of files by content: which ones the farm lacks, and their bytes. */
import {base64Of, bytesOfBase64, hexOf} from '../model/bytes';
import {ActionError, post} from './actions';

/** Limit of digests in one request. */
const kMaxAsked = 10_000;

/** The SHA-256, in hex, of the files that the farm lacks. */
export async function findMissing(digests: readonly Uint8Array[], signal: AbortSignal): Promise<Set<string>> {
  const missing = new Set<string>();
  for (let at = 0; at < digests.length; at += kMaxAsked) {
    const answer = (await post('assets/missing', {digests: digests.slice(at, at + kMaxAsked).map(base64Of)}, {signal})) as {missing?: string[]};
    answer.missing?.forEach((each) => missing.add(hexOf(bytesOfBase64(each))));
  }
  return missing;
}

/** Calls `onSent` with the number of bytes sent so far. */
export function uploadAsset(digest: string, file: Blob, onSent: (bytes: number) => void, signal: AbortSignal): Promise<void> {
  return new Promise((resolve, reject) => {
    // fetch does not report upload progress.
    const request = new XMLHttpRequest();
    const stop = () => request.abort();
    const end = (error?: Error) => {
      signal.removeEventListener('abort', stop);
      error ? reject(error) : resolve();
    };
    request.open('POST', `api/v1/assets/${digest}`);
    request.setRequestHeader('Content-Type', 'application/octet-stream');
    request.upload.onprogress = (event) => onSent(event.loaded);
    request.onload = () => {
      if (request.status >= 200 && request.status < 300) {
        onSent(file.size);
        return end();
      }
      end(new ActionError(messageOf(request)));
    };
    request.onerror = () => end(new ActionError('the connection to the coordinator broke during an upload: try again; files that arrived are not sent again'));
    request.onabort = () => end(new DOMException('stopped', 'AbortError'));
    signal.addEventListener('abort', stop);
    request.send(file);
  });
}

function messageOf(request: XMLHttpRequest): string {
  try {
    const answer = JSON.parse(request.responseText) as {error?: {message?: string}};
    return answer.error?.message ?? `the coordinator answered ${request.status}`;
  } catch {
    return `the coordinator answered ${request.status}`;
  }
}
