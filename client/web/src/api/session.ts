/** Who the browser is to the coordinator: by a cookie that only the coordinator reads, which stands for a token. */
import {ActionError, post} from './actions';

/** Whether the coordinator asks who calls, and does not know yet; false too where it cannot be reached. */
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
