// The published schemas of Kubernetes, KEDA and Compose, and faults of a document against them. Fields that a schema does not
// name are faults too. The schemas allow them, and a cluster drops them silently.
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

// The packages register their schemas with their own Ajv. This intercepts them.
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

/** Faults of a Kubernetes object against its schema, or nothing. */
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
// It names a draft, and the draft's schema is not needed.
const {$schema, ...composeRules} = composeSchema;

/** Faults of a Compose file against the schema. */
function composeFaults(doc) {
  return compose.validate(composeRules, doc)
    ? []
    : compose.errors.map((error) => `compose.yaml${error.instancePath} ${error.message}`);
}

module.exports = {composeFaults, objectFaults};
