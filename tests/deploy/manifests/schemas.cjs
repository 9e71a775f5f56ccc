// The published schemas of Kubernetes, KEDA and Compose, and what of a document does not fit them. Fields that a schema does
// not name are faults too: the schemas themselves let them pass, as a cluster drops them without a word.
'use strict';
const path = require('node:path');
const Ajv = require('ajv');

function strict(schema) {
  if (schema === null || typeof schema !== 'object') return schema;
  if (Array.isArray(schema)) return schema.map(strict);
  const made = Object.fromEntries(Object.entries(schema).map(([name, value]) => [name, strict(value)]));
  if (schema.properties && typeof schema.properties === 'object' && !('additionalProperties' in schema)) {
    made.additionalProperties = false;
  }
  return made;
}

// The packages register their schemas with an Ajv of their own, here on their way.
const addSchema = Ajv.default.prototype.addSchema;
Ajv.default.prototype.addSchema = function (schema, key, isMeta, ...rest) {
  return addSchema.call(this, isMeta ? schema : strict(schema), key, isMeta, ...rest);
};

/** The package's class of that kind. */
function modelOf({apiVersion, kind}) {
  const folder = apiVersion.startsWith('keda.sh/') ? '@kubernetes-models/keda' : 'kubernetes-models';
  const found = require(`${folder}/${apiVersion}`)[kind];
  if (found === undefined) throw new Error(`there is no ${kind} in ${apiVersion}`);
  return found;
}

/** What of a Kubernetes object does not fit its schema; empty if it fits. */
function objectFaults(doc) {
  const name = `${doc.kind}/${doc.metadata?.name}`;
  try {
    new (modelOf(doc))(doc).validate();
    return [];
  } catch (error) {
    return [`${name}: ${error.message} ${(error.errors ?? []).map((e) => JSON.stringify(e.params)).join(' ')}`];
  }
}

const composeSchema = require(path.join(path.dirname(require.resolve('dclint/package.json')), 'schemas/compose.schema.json'));
const compose = new Ajv.default({strict: false, allErrors: true});
// It names a draft whose own schema is not needed to read it.
const {$schema, ...composeRules} = composeSchema;

/** What of a Compose file does not fit the schema. */
function composeFaults(doc) {
  return compose.validate(composeRules, doc)
    ? []
    : compose.errors.map((error) => `compose.yaml${error.instancePath} ${error.message}`);
}

module.exports = {composeFaults, objectFaults};
