// Checks deploy/kubernetes and deploy/compose against the published schemas, and their parts against each other. Starts a farm
// with their arguments. Then plants faults and expects that they are found.
//
//   NODE_PATH=FOLDER/node_modules node manifests_test.cjs SOURCE-FOLDER FOLDER-OF-THE-PROGRAMS
'use strict';
const assert = require('node:assert');
const fs = require('node:fs');
const path = require('node:path');
const test = require('node:test');
const {composeFarmFaults, farmFaults, readWorld} = require('./farm.cjs');
const {documents, kustomizations, render} = require('./render.cjs');
const {composeFaults, objectFaults} = require('./schemas.cjs');
const {accessCommands, startFarm} = require('./started.cjs');

const [source, bin] = process.argv.slice(2);
const world = readWorld(source, bin);
const folders = kustomizations(source);
const base = render(folders.base);
const shared = render(folders['overlays/postgres']);
const [compose] = documents(fs.readFileSync(path.join(source, 'deploy/compose/compose.yaml'), 'utf8'));
const allFaults = (docs) => [...docs.flatMap(objectFaults), ...farmFaults(docs, world)];
const allComposeFaults = (doc) => [...composeFaults(doc), ...composeFarmFaults(doc, world)];

for (const [name, docs] of [
  ['base', base],
  ['overlays/postgres', shared],
]) {
  test(`${name} fits the schemas, and its parts agree`, () => assert.deepStrictEqual(allFaults(docs), []));
}
test('compose.yaml fits the schema, and its parts agree', () => assert.deepStrictEqual(allComposeFaults(compose), []));

const page = (name) => fs.readFileSync(path.join(source, 'docs/operate', name), 'utf8');
const argsIn = (kind) => base.find((doc) => doc.kind === kind).spec.template.spec.containers[0].args;
test('a farm starts with the arguments of the base', () =>
  startFarm({
    bin,
    commands: [...accessCommands(page('kubernetes.md'), 'Certificates'), ...accessCommands(page('kubernetes.md'), 'Start')],
    serverArgs: argsIn('StatefulSet'),
    workerArgs: argsIn('Deployment'),
    askers: ['scaler'],
  }));
test('a farm starts with the arguments of compose.yaml', () =>
  startFarm({
    bin,
    commands: accessCommands(page('compose.md'), 'On one machine'),
    serverArgs: compose.services.server.command.slice(1),
    workerArgs: compose.services.worker.command.slice(1),
    askers: [],
  }));

/** Plants one fault, and expects a found fault that matches. */
function planted(what, docs, change, words, faultsOf = allFaults) {
  test(`the check finds that ${what}`, () => {
    const changed = structuredClone(docs);
    change(
      Array.isArray(changed)
        ? (kind, name) => changed.find((doc) => doc.kind === kind && (!name || doc.metadata.name === name))
        : changed,
    );
    const found = faultsOf(changed);
    assert.ok(
      found.some((fault) => words.test(fault)),
      `found: ${found.join('; ') || 'nothing'}`,
    );
  });
}
const container = (doc) => doc.spec.template.spec.containers[0];
const replaceArg = (list, from, to) => list.splice(list.indexOf(from), 1, to);

planted('a field is misspelled', base, (get) => (container(get('StatefulSet')).readinesProbe = {}), /readinesProbe/);
planted(
  'a field has the wrong type',
  base,
  (get) => (get('Deployment').spec.template.spec.terminationGracePeriodSeconds = '120s'),
  /must be integer/,
);
planted("a field of KEDA's is misspelled", base, (get) => (get('ScaledObject').spec.minReplicas = 1), /minReplicas/);
planted('an option does not exist', base, (get) => container(get('Deployment')).args.push('--thread=4'), /no option --thread\b/);
planted(
  'a port differs',
  base,
  (get) => replaceArg(container(get('StatefulSet')).args, '--listen=0.0.0.0:7350', '--listen=0.0.0.0:7450'),
  /--listen is 7450/,
);
planted(
  'a probe asks another port',
  base,
  (get) => (container(get('StatefulSet')).livenessProbe.grpc.port = 7350),
  /livenessProbe probes/,
);
planted(
  'the liveness probe asks for readiness',
  base,
  (get) => delete container(get('StatefulSet')).livenessProbe.grpc.service,
  /livenessProbe probes/,
);
planted(
  'a label differs',
  base,
  (get) => (get('Service').spec.selector['app.kubernetes.io/component'] = 'coordinator'),
  /Service.*selector/,
);
planted(
  'a certificate is not mounted',
  base,
  (get) => container(get('Deployment')).volumeMounts.shift(),
  /nothing is mounted there/,
);
planted(
  'a secret is not created',
  base,
  (get) => (get('Deployment').spec.template.spec.volumes[0].secret.secretName = 'other'),
  /no secret other with worker.enrol/,
);
planted(
  'pods share a certificate',
  base,
  (get) => {
    const {args} = container(get('Deployment'));
    replaceArg(args, '--enrol-file=/etc/lightmill/certs/worker.enrol', '--tls-cert=/etc/lightmill/certs/worker.pem');
  },
  /have one identity/,
);
planted(
  "pods' tokens are on a shared volume",
  base,
  (get) => replaceArg(container(get('Deployment')).args, '--state=/var/lib/lightmill-worker', '--state=/etc/lightmill/certs'),
  /its token is lost/,
);
planted(
  'KEDA has another address',
  base,
  (get) => (get('ScaledObject').spec.triggers[0].metadata.scalerAddress = 'lightmill-server.farm.svc:7350'),
  /no Service lightmill-server.farm.svc/,
);
planted(
  "KEDA's key is another's",
  base,
  (get) => (get('TriggerAuthentication').spec.secretTargetRef[2].key = 'keda.pem'),
  /no secret lightmill-scaler-cert with keda.pem/,
);
planted(
  'a worker calls a port that no Service has',
  base,
  (get) => replaceArg(container(get('Deployment')).args, '--server=lightmill-server:7350', '--server=lightmill-server:7380'),
  /no such port/,
);
planted(
  'workers cannot connect',
  base,
  (get) => (get('NetworkPolicy', 'lightmill-worker').spec.egress[0].ports[0].port = 80),
  /blocks connections/,
);
planted('workers cannot resolve names', base, (get) => get('NetworkPolicy', 'lightmill-worker').spec.egress.pop(), /blocks name resolution/);
planted(
  'only one kind of name server is allowed',
  base,
  (get) => (get('NetworkPolicy', 'lightmill-worker').spec.egress[1].to = [{namespaceSelector: {}}]),
  /blocks name resolution/,
);
planted('the coordinator cannot resolve names', shared, (get) => get('NetworkPolicy', 'lightmill-server').spec.egress.pop(), /blocks name resolution/);
planted('KEDA is blocked', base, (get) => get('NetworkPolicy', 'lightmill-server').spec.ingress[0].from.pop(), /blocks KEDA/);
planted(
  'it may run as root',
  base,
  (get) => (get('Deployment').spec.template.spec.securityContext.runAsUser = 0),
  /runs as user 0/,
);
planted('a root filesystem is writable', base, (get) => delete container(get('StatefulSet')).securityContext, /filesystem is writable/);
planted(
  'a key can be read by all',
  base,
  (get) => (get('StatefulSet').spec.template.spec.volumes[0].secret.defaultMode = 0o444),
  /mode 444/,
);
planted(
  'a worker is killed while it leaves',
  base,
  (get) => (get('Deployment').spec.template.spec.terminationGracePeriodSeconds = 30),
  /30 s to stop/,
);
planted(
  'films are larger than the memory',
  base,
  (get) => replaceArg(container(get('StatefulSet')).args, '--films-gib=4', '--films-gib=16'),
  /GiB of memory/,
);
planted(
  'assets are larger than the volume',
  base,
  (get) => replaceArg(container(get('StatefulSet')).args, '--max-assets-gib=40', '--max-assets-gib=64'),
  /GiB of disk/,
);
planted(
  'a scene is larger than the memory leaves room for',
  base,
  (get) => replaceArg(container(get('Deployment')).args, '--scene-gib=2.5', '--scene-gib=3'),
  /takes up to 8.\d+ GiB of memory/,
);
planted(
  'the memory of scenes is not bounded',
  base,
  (get) => container(get('Deployment')).args.splice(container(get('Deployment')).args.indexOf('--scene-gib=2.5'), 1),
  /takes up to NaN GiB of memory/,
);
planted('two coordinators have a volume each', base, (get) => (get('StatefulSet').spec.replicas = 2), /several farms/);
planted('a rolling update would wait', shared, (get) => delete get('StatefulSet').spec.updateStrategy, /wait for the standby/);
planted('a variable is not set', shared, (get) => container(get('StatefulSet')).env.shift(), /no variable STORE/);
planted('the version is another', base, (get) => (container(get('Deployment')).image = 'lightmill-worker:9.9'), /version/);
planted(
  "an image is another program's",
  base,
  (get) => (container(get('Deployment')).image = container(get('StatefulSet')).image),
  /image lightmill-server\S* for lightmill-worker/,
);
planted('nodes cannot be drained', base, (get) => (get('PodDisruptionBudget').spec.maxUnavailable = 0), /be drained/);

const plantedInCompose = (what, change, words) => planted(what, compose, change, words, allComposeFaults);
plantedInCompose(
  'a field of Compose is misspelled',
  (doc) => (doc.services.worker.depend_on = ['server']),
  /additional properties/,
);
plantedInCompose('an option does not exist, with Compose', (doc) => doc.services.server.command.push('--page=1'), /no option --page/);
plantedInCompose('no program listens, with Compose', (doc) => doc.services.server.ports.push('80:80'), /no program listens on 80/);
plantedInCompose(
  'a certificate is not created, with Compose',
  (doc) => (doc.services.worker.volumes[0] = './certs/w.pem:/etc/lightmill/certs/w.pem:ro'),
  /no .*w\.pem/,
);
plantedInCompose(
  'a worker has a wrong address, with Compose',
  (doc) => {
    doc.services.coordinator = doc.services.server;
    delete doc.services.server;
  },
  /does not lead/,
);
plantedInCompose(
  'workers share a certificate, with Compose',
  (doc) => replaceArg(doc.services.worker.command, '--enrol-file=/etc/lightmill/certs/worker.enrol', '--tls-cert=/etc/lightmill/certs/ca.pem'),
  /have one identity/,
);
plantedInCompose(
  'tokens are lost, with Compose',
  (doc) => replaceArg(doc.services.worker.command, '--state=/var/lib/lightmill-worker', '--state=/etc/lightmill/certs/ca.pem'),
  /its token is lost/,
);
