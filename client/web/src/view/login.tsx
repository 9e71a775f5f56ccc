/** Login with a token, and logout. */
import {useState} from 'preact/hooks';
import {ActionError} from '../api/actions';
import {logIn, logOut} from '../api/session';
import {farm, useFarm} from './store';

export function LoginPage() {
  const [token, setToken] = useState('');
  const [failure, setFailure] = useState('');
  const [busy, setBusy] = useState(false);
  const submit = async (event: Event) => {
    event.preventDefault();
    setBusy(true);
    setFailure('');
    try {
      await logIn(token);
      farm.begin();
    } catch (error) {
      setFailure(error instanceof ActionError ? error.message : String(error));
    } finally {
      setBusy(false);
    }
  };
  return (
    <section class="page login" aria-labelledby="login-title">
      <h1 id="login-title">Log in</h1>
      <p>
        This farm requires a login. An admin can make a token for you with <code>lightmill tokens create YOUR-NAME --roles view,submit</code>.
      </p>
      <form onSubmit={(event) => void submit(event)}>
        <label>
          Token
          <input type="password" autocomplete="current-password" spellcheck={false} value={token} onInput={(event) => setToken(event.currentTarget.value)} />
        </label>
        <button type="submit" disabled={busy}>
          Log in
        </button>
      </form>
      {failure && (
        <p class="notice failure" role="alert">
          {failure}
        </p>
      )}
    </section>
  );
}

/** The user's name and the logout button. Nothing if the farm has no logins. */
export function LogOut() {
  const {greeting, link} = useFarm();
  if (!greeting?.caller || link === 'closed') {
    return null;
  }
  const leave = () => void logOut().catch(() => undefined).then(() => farm.begin());
  return (
    <span class="caller">
      <span title={`Roles: ${greeting.roles.join(', ')}`}>{greeting.caller}</span>
      <button type="button" onClick={leave}>
        Log out
      </button>
    </span>
  );
}
