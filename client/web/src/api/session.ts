/** The browser's session: a cookie that stands for a token. Only the coordinator reads it. */
import {ActionError, post} from './actions';

/** Whether the coordinator requires a login and this browser has none. False if the coordinator cannot be reached. */
export async function needsLogin(): Promise<boolean> {
  const response = await fetch('api/v1/farm').catch(() => undefined);
  return response?.status === 401;
}

export async function logIn(token: string): Promise<void> {
  if (!token.trim()) {
    throw new ActionError('A token is needed: an admin makes one with `lightmill tokens create`.');
  }
  await post('login', {token: token.trim()});
}

export async function logOut(): Promise<void> {
  await post('logout');
}
