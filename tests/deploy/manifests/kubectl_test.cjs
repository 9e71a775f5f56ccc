// Checks that kubectl renders the kustomizations of deploy/kubernetes like render.cjs. Exit code 77 without a recent kubectl.
//
//   NODE_PATH=FOLDER/node_modules node kubectl_test.cjs SOURCE-FOLDER
'use strict';
const assert = require('node:assert');
const childProcess = require('node:child_process');
const {documents, kustomizations, nameOf, render} = require('./render.cjs');

const SKIPPED = 77;
const byName = (all) => Object.fromEntries(all.map((doc) => [nameOf(doc), doc]));

for (const [name, folder] of Object.entries(kustomizations(process.argv[2]))) {
  const made = childProcess.spawnSync('kubectl', ['kustomize', folder], {encoding: 'utf8'});
  // Kustomizations have had these fields since kubectl 1.21.
  if (made.error || /invalid Kustomization|unknown field/.test(made.stderr)) {
    console.log(`skipped: ${made.error ? 'no kubectl' : 'kubectl is older than 1.21'}`);
    process.exit(SKIPPED);
  }
  assert.strictEqual(made.status, 0, made.stderr);
  assert.deepStrictEqual(byName(documents(made.stdout)), byName(render(folder)));
  console.log(`${name}: kubectl renders it alike`);
}
