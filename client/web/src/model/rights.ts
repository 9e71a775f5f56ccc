/** The caller's rights, as the coordinator reports them. The coordinator checks them again. */
import type {FarmGreeting} from '../wire/lightmill/v1/web_pb';

export type Rights = Pick<FarmGreeting, 'caller' | 'roles' | 'may' | 'mayWithOwn'>;

/** Why the caller may not call `method` on a job of this owner. Undefined if it is allowed, or not known yet. */
export function refusalOf(rights: Rights | undefined, method: string, owner?: string): string | undefined {
  if (!rights || rights.may.includes(method)) {
    return undefined;
  }
  const roles = rights.roles.join(', ') || 'none';
  const own = rights.mayWithOwn.includes(method);
  if (own && owner !== undefined) {
    return owner !== '' && owner === rights.caller ? undefined : `The job belongs to another user, and your roles (${roles}) allow this only for your own jobs`;
  }
  return own ? undefined : `Your roles (${roles}) do not allow this`;
}
