/** When to connect again, and when a silent connection counts as lost. Pure: the time is an argument, in milliseconds. */

/** 'closed': the coordinator asks who calls, and what it was shown does not hold. */
export type Link = 'connecting' | 'connected' | 'lost' | 'closed';

/** With this code the coordinator closes a WebSocket whose caller has shown what holds no longer. */
export const kNoLongerAllowed = 4401;

/** The coordinator says something every five seconds at least. */
export const kSilenceMs = 12_000;

/** 0.5 s after the first failure, then twice as long each time, at most 10 s; spread by `random` in [0, 1) over a half of that. */
export function retryDelayMs(failures: number, random: number): number {
  return Math.min(500 * 2 ** Math.max(0, failures - 1), 10_000) * (0.75 + random / 2);
}

/** Whether nothing came for too long. Hidden pages are told nothing, and expect nothing. */
export function isSilent(lastHeardMs: number, nowMs: number, hidden: boolean): boolean {
  return !hidden && nowMs - lastHeardMs > kSilenceMs;
}
