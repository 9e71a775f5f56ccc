/** Rules of reconnection, and of the timeout of a silent connection. Pure: times are arguments, in milliseconds. */

/** 'closed': the coordinator requires a login, and the session is not valid. */
export type Link = 'connecting' | 'connected' | 'lost' | 'closed';

/** The code with which the coordinator closes a WebSocket whose session has expired. */
export const kNoLongerAllowed = 4401;

/** The coordinator sends a message at least every five seconds. */
export const kSilenceMs = 12_000;

/** 0.5 s after the first failure, doubled each time, at most 10 s. `random` in [0, 1) spreads it over half of that. */
export function retryDelayMs(failures: number, random: number): number {
  return Math.min(500 * 2 ** Math.max(0, failures - 1), 10_000) * (0.75 + random / 2);
}

/** Whether nothing came for too long. Hidden pages get no messages, so they never count as silent. */
export function isSilent(lastHeardMs: number, nowMs: number, hidden: boolean): boolean {
  return !hidden && nowMs - lastHeardMs > kSilenceMs;
}
