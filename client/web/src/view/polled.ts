/** Polling of the coordinator while the page is visible. */
import {useEffect, useRef, useState} from 'preact/hooks';
import {useFarm} from './store';

/** The newest answer, and the failure of the last request. A new `key` makes a request at once. */
export function usePolled<T>(fetch: (signal: AbortSignal) => Promise<T>, key: string, everyMs: number): [T | undefined, string] {
  const [answer, setAnswer] = useState<{key: string; value: T}>();
  const [failure, setFailure] = useState('');
  const {link} = useFarm();
  const question = useRef(fetch);
  question.current = fetch;
  useEffect(() => {
    const gone = new AbortController();
    let asking = false;
    const poll = async () => {
      if (document.hidden || asking) {
        return;
      }
      asking = true;
      try {
        const value = await question.current(gone.signal);
        if (!gone.signal.aborted) {
          setAnswer({key, value});
          setFailure('');
        }
      } catch (error) {
        if (!gone.signal.aborted) {
          setFailure(error instanceof Error ? error.message : String(error));
        }
      }
      asking = false;
    };
    void poll();
    const timer = setInterval(() => void poll(), everyMs);
    document.addEventListener('visibilitychange', poll, {signal: gone.signal});
    return () => {
      gone.abort();
      clearInterval(timer);
    };
    // After a reconnection it may be another farm.
  }, [key, everyMs, link === 'connected']);
  return [answer?.key === key ? answer.value : undefined, failure];
}
