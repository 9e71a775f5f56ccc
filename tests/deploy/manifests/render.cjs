// Renders a kustomization like kustomize, as far as deploy/kubernetes uses it: resources, patches by path, a namespace, images.
// Anything else is an error.
'use strict';
const fs = require('node:fs');
const path = require('node:path');
const yaml = require('yaml');

/** All documents of a YAML 1.1 text, the version that Kubernetes reads: 0440 is octal. */
function documents(text) {
  return yaml.parseAllDocuments(text, {version: '1.1'}).map((document) => {
    if (document.errors.length > 0) throw document.errors[0];
    return document.toJS();
  });
}
const read = (file) => documents(fs.readFileSync(file, 'utf8'));

/** Keys that identify the entries of a list. Other lists are replaced as a whole. */
const KEYS = {containers: 'name', env: 'name', volumes: 'name', volumeMounts: 'mountPath'};
const isMap = (value) => value !== null && typeof value === 'object' && !Array.isArray(value);

function mergeLists(key, target, patch) {
  const merged = [...target];
  for (const entry of patch) {
    const at = merged.findIndex((other) => other[key] === entry[key]);
    if (entry.$patch === 'delete') merged.splice(at, 1);
    else if (at < 0) merged.push(entry);
    else merged[at] = merge(merged[at], entry);
  }
  return merged;
}

function merge(target, patch) {
  const merged = {...target};
  for (const [name, value] of Object.entries(patch)) {
    if (value === null) delete merged[name];
    else if (isMap(value) && isMap(merged[name])) merged[name] = merge(merged[name], value);
    else if (name in KEYS && Array.isArray(merged[name])) merged[name] = mergeLists(KEYS[name], merged[name], value);
    else merged[name] = value;
  }
  return merged;
}

/** The folders of deploy/kubernetes with a kustomization, by name. */
function kustomizations(source) {
  return Object.fromEntries(['base', 'overlays/postgres'].map((name) => [name, path.join(source, 'deploy/kubernetes', name)]));
}

const nameOf = (doc) => `${doc.kind}/${doc.metadata?.name}`;

/** {what kustomization.yaml names, their order aside}: all objects of the folder. */
function render(folder) {
  const [kustomization] = read(path.join(folder, 'kustomization.yaml'));
  const {apiVersion, kind, namespace, resources, patches = [], images = [], ...rest} = kustomization;
  if (kind !== 'Kustomization' || Object.keys(rest).length > 0) {
    throw new Error(`${folder}: this test does not support ${Object.keys(rest).join(', ')} in a kustomization`);
  }
  let docs = resources.flatMap((entry) => {
    const file = path.join(folder, entry);
    return fs.statSync(file).isDirectory() ? render(file) : read(file);
  });
  for (const patch of patches.flatMap((entry) => read(path.join(folder, entry.path)))) {
    const at = docs.findIndex((doc) => nameOf(doc) === nameOf(patch));
    if (at < 0) throw new Error(`${folder}: a patch for ${nameOf(patch)}, which does not exist`);
    docs[at] = merge(docs[at], patch);
  }
  docs = structuredClone(docs);
  for (const doc of docs) {
    if (namespace !== undefined && doc.kind !== 'Namespace') doc.metadata.namespace = namespace;
    for (const container of doc.spec?.template?.spec?.containers ?? []) {
      const image = images.find((entry) => entry.name === container.image);
      if (image) container.image = `${image.newName ?? image.name}:${image.newTag}`;
    }
  }
  return docs;
}

module.exports = {documents, kustomizations, nameOf, render};
