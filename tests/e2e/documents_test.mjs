// The documents as pages of a real coordinator, in a real browser:
//   node documents_test.mjs FOLDER-OF-PROGRAMS
import assert from 'node:assert/strict';
import {readdirSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {kSource} from './farm.mjs';
import {assertFits, kDesktop, kPhone, Session} from './session.mjs';

const session = new Session(process.argv[2]);
/** The text of each address that was visited; empty for what is no page. */
const visited = new Map();

before(async () => {
  await session.farm.startServer();
  await session.startBrowser();
});
after(() => session.close());

async function visit(address) {
  if (!visited.has(address)) {
    const reply = await fetch(address);
    assert.equal(reply.status, 200, address);
    visited.set(address, reply.headers.get('content-type').startsWith('text/html') ? await reply.text() : '');
  }
  return visited.get(address);
}

/** Links of a page to the coordinator, as [address, anchor]. */
function links(address, text) {
  return [...text.matchAll(/ (?:href|src)="([^"]+)"/g)]
    .map(([, link]) => new URL(link.replaceAll('&amp;', '&'), address))
    .filter((url) => url.origin === new URL(session.farm.page).origin)
    .map((url) => [url.origin + url.pathname, decodeURIComponent(url.hash.slice(1))]);
}

test('each link from /docs leads to a page, a picture or a heading', async () => {
  const waiting = [`${session.farm.page}docs`];
  for (const page of waiting) {
    for (const [address, anchor] of links(page, await visit(page))) {
      const text = await visit(address);
      if (anchor && !anchor.startsWith('/')) {
        assert.ok(text.includes(` id="${anchor}"`), `${page}: there is no heading for ${address}#${anchor}`);
      }
      if (text && address.includes('/docs') && !waiting.includes(address)) {
        waiting.push(address);
      }
    }
  }
});

test('each document is in the table of contents, and each of its pictures is served', () => {
  const files = readdirSync(join(kSource, 'docs'), {recursive: true}).map((name) => `${session.farm.page}docs/${name}`);
  const documents = files.filter((name) => name.endsWith('.md')).map((name) => name.replace(/\.md$/, ''));
  const pictures = files.filter((name) => /\.(png|svg)$/.test(name));
  assert.ok(documents.length > 30 && pictures.length > 30);
  const start = `${session.farm.page}docs`;
  const contents = links(start, /<nav id="contents".*?<\/nav>/s.exec(visited.get(start))[0]).map(([address]) => address);
  const missing = [...documents.filter((address) => !contents.includes(address)), ...pictures.filter((address) => !visited.has(address))];
  assert.deepEqual(missing, []);
});

test('a document is styled like the page, and fits desktops and phones', async () => {
  const page = await session.open('', {viewport: kDesktop, colorScheme: 'light'});
  await page.getByRole('link', {name: 'Docs'}).click();
  await page.getByRole('navigation', {name: 'Documents'}).getByRole('link', {name: 'Rendering', exact: true}).click();
  await page.getByRole('heading', {name: 'Limits of a job'}).waitFor();
  assert.ok(page.url().endsWith('/docs/guide/render'));
  const light = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  await assertFits(page);
  await page.emulateMedia({colorScheme: 'dark'});
  await page.waitForFunction((old) => getComputedStyle(document.body).backgroundColor !== old, light);
  await page.setViewportSize(kPhone);
  await assertFits(page);
  await page.getByRole('link', {name: 'Lightmill, all jobs'}).click();
  await page.getByRole('heading', {name: 'Jobs'}).waitFor();
  await assertFits(page);
  session.assertQuiet();
});
