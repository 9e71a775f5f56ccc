// The page of a farm with authentication, in a real browser: node login_test.mjs FOLDER-OF-PROGRAMS
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {eventually} from './farm.mjs';
import {assertFits, kDesktop, kPhone, Session} from './session.mjs';

const [programs] = process.argv.slice(2);
const session = new Session(programs);
const {farm} = session;
let page;
const tokens = {};

async function logIn(token) {
  await page.getByLabel('Token').fill(token);
  await page.getByRole('button', {name: 'Log in'}).click();
}

const createToken = (name, roles) => farm.lightmill('tokens', 'create', name, '--roles', roles).trim();

before(async () => {
  await farm.startServer();
  // The first token is created before the coordinator requires one.
  farm.token = createToken('root', 'admin');
  await farm.stop('server');
  farm.serverOptions = ['--authenticate'];
  await farm.startServer();
  tokens.ada = createToken('ada', 'submit');
  tokens.bob = createToken('bob', 'view,submit');
  tokens.eve = createToken('eve', 'view');
  tokens.root = farm.token;
  for (const name of ['ada', 'bob']) {
    farm.token = tokens[name];
    farm.submit('cornell-bench-blocks', '--spp', '4', '--size', '64x64', '--name', `of ${name}`);
  }
  await session.startBrowser();
});

after(() => session.close());

test('an unknown user is asked for a token and shown nothing', async () => {
  page = await session.open('#/jobs');
  await page.getByRole('heading', {name: 'Log in'}).waitFor();
  assert.equal(await page.getByText('of ada').count(), 0);
  await page.getByRole('status').getByText('not logged in').waitFor();
});

test('an unknown token and an empty token are refused', async () => {
  await logIn(tokens.ada.replace(/.$/, (last) => (last === '0' ? '1' : '0')));
  await page.getByRole('alert').getByText('is unknown here').waitFor();
  await logIn('');
  await page.getByRole('alert').getByText('A token is needed').waitFor();
});

test('axe finds no serious fault in the form', async () => {
  const opened = await session.open('#/jobs', {bypassCSP: true});
  await opened.getByRole('heading', {name: 'Log in'}).waitFor();
  await assertFits(opened);
  await opened.context().close();
});

test('a submitter sees and controls only her own job', async () => {
  await logIn(tokens.ada);
  await page.getByRole('link', {name: 'of ada'}).click();
  await page.locator('.caller').getByText('ada', {exact: true}).waitFor();
  await page.getByRole('button', {name: 'Pause'}).click();
  await page.locator('.job-head .badge', {hasText: 'paused'}).waitFor();
  await page.goto(`${farm.page}#/jobs`);
  await page.getByRole('link', {name: 'of ada'}).waitFor();
  assert.equal(await page.getByRole('link', {name: 'of bob'}).count(), 0);
  await page.goto(`${farm.page}#/jobs/2`);
  await page.getByRole('alert').getByText('belongs to another user').waitFor();
});

test('no script can read the login, and a reload keeps it', async () => {
  assert.equal(await page.evaluate(() => document.cookie + JSON.stringify(localStorage) + JSON.stringify(sessionStorage)), '{}{}');
  await page.goto(`${farm.page}#/jobs`);
  await page.reload();
  await page.getByRole('link', {name: 'of ada'}).waitFor();
});

test('the header of a user who is logged in fits a phone', async () => {
  await page.setViewportSize(kPhone);
  await page.getByRole('button', {name: 'Log out'}).waitFor();
  await assertFits(page);
  await page.setViewportSize(kDesktop);
});

test('a user who logs out is asked again', async () => {
  const [cookie] = await page.context().cookies();
  await page.getByRole('button', {name: 'Log out'}).click();
  await page.getByRole('heading', {name: 'Log in'}).waitFor();
  assert.equal(await page.getByText('of ada').count(), 0);
  assert.deepEqual(await page.context().cookies(), []);
  const again = await fetch(`${farm.page}api/v1/jobs`, {headers: {Cookie: `${cookie.name}=${cookie.value}`}});
  assert.equal(again.status, 401);
});

test('buttons say when the roles do not allow them', async () => {
  await logIn(tokens.bob);
  await page.getByRole('link', {name: 'of ada'}).click();
  const pause = page.getByRole('button', {name: 'Resume'});
  await pause.waitFor();
  assert.ok(await pause.isDisabled());
  assert.match(await pause.getAttribute('title'), /another user.*view, submit/);
  assert.ok(await page.getByLabel('Priority', {exact: true}).isDisabled());
  // A user who can see the job can submit a clone of it.
  assert.ok(await page.getByRole('button', {name: 'Clone'}).isEnabled());
  await page.goto(`${farm.page}#/jobs/2`);
  assert.ok(await page.getByRole('button', {name: 'Pause'}).isEnabled());
});

test('a user who can only view is offered no submission', async () => {
  const before = page;
  page = await session.open('#/jobs/1');
  await logIn(tokens.eve);
  await page.locator('.caller').getByText('eve', {exact: true}).waitFor();
  for (const name of ['Edit & render again', 'Clone']) {
    const button = page.getByRole('button', {name});
    await button.waitFor();
    assert.ok(await button.isDisabled());
    assert.match(await button.getAttribute('title'), /Your roles \(view\) do not allow this/);
  }
  await page.goto(`${farm.page}#/jobs`);
  assert.ok(await page.getByRole('button', {name: 'Submit a scene'}).isDisabled());
  const dropped = await page.evaluateHandle(() => {
    const transfer = new DataTransfer();
    transfer.items.add(new File(['{}'], 'scene.json'));
    return transfer;
  });
  await page.locator('.drop-zone').dispatchEvent('drop', {dataTransfer: dropped});
  await page.getByRole('alert').getByText('Your roles (view)').waitFor();
  await page.context().close();
  page = before;
});

test('only an admin reads the action log, which says what changed', async () => {
  const before = page;
  const kinds = () => page.getByRole('group', {name: 'Kind of events'});
  page = await session.open('#/workers');
  await logIn(tokens.eve);
  await kinds().getByRole('button', {name: 'workers'}).waitFor();
  assert.equal(await kinds().getByRole('button', {name: 'actions'}).count(), 0);
  await page.context().close();
  page = await session.open('#/workers');
  await logIn(tokens.root);
  await kinds().getByRole('button', {name: 'actions'}).click();
  await page.getByRole('listitem').getByText('ada: PauseJob of ada: state queued -> paused').waitFor();
  await page.context().close();
  page = before;
});

test('a user whose login ends sees it at once, and a valid token logs in again', async () => {
  farm.token = tokens.root;
  farm.lightmill('tokens', 'revoke', /^lightmill_([0-9a-f]{12})_/.exec(tokens.bob)[1]);
  await page.getByRole('heading', {name: 'Log in'}).waitFor();
  assert.equal(await page.locator('canvas').count(), 0);
  await logIn(tokens.ada);
  await page.goto(`${farm.page}#/jobs`);
  await page.getByRole('link', {name: 'of ada'}).waitFor();
});

test('a restarted coordinator asks again', async () => {
  await farm.stop('server');
  await page.getByRole('alert').getByText('is lost').waitFor();
  await farm.startServer();
  await eventually('the form comes', () => page.getByRole('heading', {name: 'Log in'}).isVisible());
});

test('the page logs no error', () => {
  session.assertQuiet();
});
