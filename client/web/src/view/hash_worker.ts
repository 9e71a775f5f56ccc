/** A web worker that hashes files, so that the page stays responsive. */
import type {HashAnswer, HashQuestion} from './hashing';

addEventListener('message', ({data}: MessageEvent<HashQuestion>) => {
  const answer = async (): Promise<HashAnswer> => {
    try {
      const bytes = await data.file.arrayBuffer();
      return {digest: new Uint8Array(await crypto.subtle.digest('SHA-256', bytes))};
    } catch (error) {
      return {failure: error instanceof Error ? error.message : String(error)};
    }
  };
  void answer().then((each) => postMessage(each));
});
