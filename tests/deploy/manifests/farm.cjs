// Checks that the parts of a farm in a cluster or in a Compose file agree with each other, the programs' options, the image and
// the pages in docs/operate. All functions return faults as text.
'use strict';
const childProcess = require('node:child_process');
const fs = require('node:fs');
const path = require('node:path');
const {nameOf} = require('./render.cjs');

// Memory of a worker that no option limits (docs/operate/limits.md): photons, uploaded scene files (as a part of --scene-gib),
// and the program itself.
const PHOTONS_GIB = 0.25;
const FILES_PART = 1 / 8;
const PROGRAM_GIB = 0.5;

const LISTENS = {'--listen': 'grpc', '--http': 'page', '--health': 'health'};
const GIB = 2 ** 30;

/** The facts to compare manifests with, read from the sources and the programs. */
function readWorld(source, bin) {
  const text = (...names) => fs.readFileSync(path.join(source, ...names), 'utf8');
  const docs = ['kubernetes.md', 'compose.md'].map((page) => text('docs/operate', page)).join('\n');
  const unit = (program) => text('deploy/systemd', `${program}.service`);
  const help = (program) => {
    const shown = childProcess.execFileSync(path.join(bin, program), ['--help'], {encoding: 'utf8'});
    return new Set([...shown.matchAll(/^ {2,8}(?:-\w,)?(--[a-z][a-z-]*)(?=[\s=]|$)/gm)].map((match) => match[1]));
  };
  const users = new Map(
    [...text('deploy/containers/Containerfile').matchAll(/useradd .*--uid (\d+) .* (\S+) \\/g)].map((match) => [
      match[2],
      Number(match[1]),
    ]),
  );
  const programs = {};
  for (const [program, user] of [
    ['lightmill-server', 'lightmill'],
    ['lightmill-worker', 'lightmill-worker'],
  ]) {
    programs[program] = {
      options: help(program),
      user: users.get(user),
      stopSeconds: Number(/^TimeoutStopSec=(\d+)$/m.exec(unit(program))[1]),
    };
  }
  // `kubectl create secret generic NAME --from-file=DIR/KEY --from-literal=KEY=…`, also on several lines.
  const secrets = new Map();
  for (const [, name, rest] of docs.replace(/\\\n/g, ' ').matchAll(/create secret generic (\S+)(.*)/g)) {
    secrets.set(
      name,
      new Set([...rest.matchAll(/--from-(?:file=\S*\/(\S+)|literal=([^=\s]+)=)/g)].map((match) => match[1] ?? match[2])),
    );
  }
  const hosts = new Set(
    [...docs.matchAll(/lightmill certs server certs ([^#\n]*)/g)].flatMap((match) => match[1].trim().split(/\s+/)),
  );
  const files = new Set(
    [
      ...docs.matchAll(/lightmill certs (?:server()|(?:worker|person)) certs (\S+)/g),
      ...docs.matchAll(/lightmill tokens create .*--out ()()certs\/(\S+)/g),
    ].map(([, server, owner, token]) => token ?? (server === '' ? 'server.pem' : `${owner}.pem`)),
  );
  return {
    programs,
    secrets,
    hosts,
    files: files.add('ca.pem'),
    version: /project\(lightmill VERSION (\S+)/.exec(text('CMakeLists.txt'))[1],
  };
}

/** {"--option": "value"} of arguments --option=value. */
const optionsOf = (args) => new Map(args.map((arg) => [arg.split('=')[0], arg.slice(arg.indexOf('=') + 1)]));
const portOf = (address) => Number(address.slice(address.lastIndexOf(':') + 1));
const hostOf = (address) => address.slice(0, address.lastIndexOf(':'));
const matches = (labels, selector) => Object.entries(selector ?? {}).every(([name, value]) => labels?.[name] === value);
const bytesOf = (quantity) => Number(/^(\d+)Gi$/.exec(quantity)?.[1]) * GIB;

/** Checks a program's arguments: the options exist, and files are in mounted volumes. */
function argumentFaults(program, args, mounts, add) {
  for (const arg of args) {
    const option = arg.split('=')[0];
    if (!program.options.has(option)) add(`there is no option ${option}`);
    if (!arg.includes('=')) add(`${arg} is not --option=value`);
    const value = arg.slice(arg.indexOf('=') + 1);
    if (value.startsWith('/') && !mounts.some((mount) => value === mount || value.startsWith(`${mount}/`)))
      add(`${arg}: nothing is mounted there`);
  }
}

function securityFaults(program, pod, container, add) {
  if (pod.securityContext?.runAsNonRoot !== true) add('it may run as root');
  if (pod.securityContext?.runAsUser !== program.user)
    add(`it runs as user ${pod.securityContext?.runAsUser}, the image has ${program.user}`);
  if (pod.securityContext?.fsGroup !== program.user) add('its group cannot read its secrets');
  if (pod.securityContext?.seccompProfile?.type !== 'RuntimeDefault') add('it has no seccomp profile');
  if (pod.automountServiceAccountToken !== false) add('it mounts a token of the cluster');
  const own = container.securityContext ?? {};
  if (own.readOnlyRootFilesystem !== true) add('its root filesystem is writable');
  if (own.allowPrivilegeEscalation !== false) add('it may gain privileges');
  if (own.capabilities?.drop?.[0] !== 'ALL') add('it keeps capabilities');
}

/** Every volume is mounted, every mount has its volume, and named files are in their secrets. */
function volumeFaults(workload, pod, container, options, needSecret, add) {
  const volumes = new Map(
    [...(pod.volumes ?? []), ...(workload.spec.volumeClaimTemplates ?? []).map((claim) => ({name: claim.metadata.name}))].map(
      (volume) => [volume.name, volume],
    ),
  );
  const mounts = container.volumeMounts ?? [];
  for (const mount of mounts) if (!volumes.has(mount.name)) add(`volume ${mount.name} is not there`);
  for (const name of volumes.keys()) if (!mounts.some((mount) => mount.name === name)) add(`volume ${name} is not mounted`);
  for (const {name, mountPath} of mounts) {
    const secret = volumes.get(name)?.secret;
    for (const value of options.values()) {
      if (secret && value.startsWith(`${mountPath}/`)) needSecret(secret.secretName, value.slice(mountPath.length + 1));
    }
    // The programs refuse a key that everyone can read. They may read it only as members of its group.
    if (secret && secret.defaultMode !== 0o440)
      add(`secret ${secret.secretName} has the mode ${secret.defaultMode?.toString(8)}`);
  }
}

/** Workers that share a certificate or token are one identity. Its results cannot be compared with those of another identity. */
function identityFaults(options, isOwn, add) {
  if (options.has('--tls-cert') || options.has('--token-file') || !options.has('--enrol-file'))
    add('all of these workers have one identity');
  else if (!isOwn(options.get('--state'))) add('its token is lost when the program ends');
}

function portFaults(container, options, add) {
  const named = new Map((container.ports ?? []).map((port) => [port.name, port.containerPort]));
  for (const [option, name] of Object.entries(LISTENS)) {
    const port = options.has(option) ? portOf(options.get(option)) : undefined;
    if (named.get(name) !== port) add(`${option} is ${port}, but the port ${name} is ${named.get(name)}`);
  }
  const health = options.has('--health') ? portOf(options.get('--health')) : undefined;
  for (const [kind, services] of [
    ['readinessProbe', [undefined]],
    ['livenessProbe', ['live']],
    ['startupProbe', []],
  ]) {
    const grpc = container[kind]?.grpc;
    if (container[kind] !== undefined && (grpc?.port !== health || !services.includes(grpc?.service)))
      add(`${kind} probes ${JSON.stringify(container[kind])}`);
  }
  if (health !== undefined && (container.readinessProbe === undefined || container.livenessProbe === undefined))
    add('it has no probes');
}

/** The maximum use fits into the limits. */
function sizeFaults(workload, container, options, add) {
  const {requests, limits} = container.resources ?? {};
  if (!(bytesOf(requests?.memory) <= bytesOf(limits?.memory)) || requests?.cpu === undefined)
    add('resources: set requests of cpu and memory, and a limit of memory');
  const gib = (name) => Number(options.get(name));
  if (container.command[0] === 'lightmill-server') {
    const memory = gib('--films-gib') + gib('--wire-gib');
    if (!(memory * GIB < bytesOf(limits?.memory))) add(`its options take ${memory} GiB of memory, of ${limits?.memory}`);
    for (const claim of workload.spec.volumeClaimTemplates ?? []) {
      const disk = gib('--films-gib') + gib('--max-assets-gib') + 1;
      if (!(disk * GIB <= bytesOf(claim.spec.resources.requests.storage)))
        add(`its options take ${disk} GiB of disk, of ${claim.spec.resources.requests.storage}`);
    }
  } else {
    // The largest scene may be held, even beyond --scenes-gib, while another one is compiled.
    const scene = gib('--scene-gib');
    const scenes = Math.max(gib('--scenes-gib'), scene) + scene * (1 + FILES_PART);
    const memory = scenes + gib('--assets-gib') + gib('--results-mib') / 1024 + PHOTONS_GIB + PROGRAM_GIB;
    if (!(memory * GIB <= bytesOf(limits?.memory))) add(`it takes up to ${memory} GiB of memory, of ${limits?.memory}`);
  }
}

function workloadFaults(workload, world, needSecret, add) {
  const {spec: pod, metadata} = workload.spec.template;
  if (!matches(metadata.labels, workload.spec.selector.matchLabels)) add('its selector does not find its pods');
  if (pod.containers.length !== 1) add('one container is expected');
  const [container] = pod.containers;
  const program = world.programs[container.command?.[0]];
  if (program === undefined) {
    add(`there is no program ${container.command?.[0]}`);
    return;
  }
  const options = optionsOf(container.args);
  argumentFaults(
    program,
    container.args,
    container.volumeMounts.map((mount) => mount.mountPath),
    add,
  );
  const variables = new Set((container.env ?? []).map((variable) => variable.name));
  for (const arg of container.args) {
    for (const [, name] of arg.matchAll(/\$\(([^)]*)\)/g)) if (!variables.has(name)) add(`${arg}: there is no variable ${name}`);
  }
  for (const {valueFrom} of container.env ?? []) {
    if (valueFrom?.secretKeyRef) needSecret(valueFrom.secretKeyRef.name, valueFrom.secretKeyRef.key);
    const own = valueFrom?.resourceFieldRef;
    if (
      own &&
      (own.containerName !== container.name || container.resources?.limits?.[own.resource.replace('limits.', '')] === undefined)
    )
      add(`it uses ${JSON.stringify(own)}, which is not set`);
  }
  if (container.image !== `${container.command[0]}:${world.version}`) add(`image ${container.image} for ${container.command[0]}, the version is ${world.version}`);
  if (pod.terminationGracePeriodSeconds !== program.stopSeconds)
    add(`it has ${pod.terminationGracePeriodSeconds} s to stop, but ${program.stopSeconds} s as a service`);
  // Otherwise names of Services arrive as variables, and variables that begin with LIGHTMILL_ are options.
  if (pod.enableServiceLinks !== false) add('it is given variables for Services');
  securityFaults(program, pod, container, add);
  volumeFaults(workload, pod, container, options, needSecret, add);
  if (container.command[0] === 'lightmill-worker') {
    const name = container.volumeMounts.find((mount) => mount.mountPath === options.get('--state'))?.name;
    identityFaults(options, () => pod.volumes.find((volume) => volume.name === name)?.emptyDir !== undefined, add);
  }
  portFaults(container, options, add);
  sizeFaults(workload, container, options, add);
}

/** All objects of a farm, as kustomize builds them. */
function farmFaults(docs, world) {
  const faults = [];
  const needed = [];
  const of = (kind) => docs.filter((doc) => doc.kind === kind);
  const named = (kind, name) => of(kind).find((doc) => doc.metadata.name === name);
  const workloads = [...of('StatefulSet'), ...of('Deployment')];
  const selected = (selector) => workloads.filter((workload) => matches(workload.spec.template.metadata.labels, selector));
  const optionsIn = (workload) => optionsOf(workload.spec.template.spec.containers[0].args);
  const namespaces = new Set(docs.filter((doc) => doc.kind !== 'Namespace').map((doc) => doc.metadata.namespace));
  if (namespaces.size !== 1 || named('Namespace', [...namespaces][0]) === undefined)
    faults.push(`namespaces: ${[...namespaces]}`);

  /** HOST:PORT for a caller in the cluster: a Service that the coordinator's certificate names. */
  const addressFaults = (address, add) => {
    const [name, ...rest] = hostOf(address).split('.');
    const service = named('Service', name);
    if (service === undefined || (rest.length > 0 && rest.join('.') !== `${service.metadata.namespace}.svc`))
      add(`there is no Service ${hostOf(address)}`);
    else if (!service.spec.ports.some((port) => port.port === portOf(address) && port.targetPort === 'grpc'))
      add(`${address}: the Service has no such port`);
    if (!world.hosts.has(hostOf(address))) add(`no certificate is made for ${hostOf(address)}`);
  };

  const checks = {
    StatefulSet: (doc, add) => {
      workloadFaults(doc, world, (...secret) => needed.push(secret), add);
      if (named('Service', doc.spec.serviceName) === undefined) add(`there is no Service ${doc.spec.serviceName}`);
      const isShared = optionsIn(doc).has('--store');
      if (isShared === optionsIn(doc).has('--data')) add('its state must be in exactly one place: --store or --data');
      if (isShared === (doc.spec.volumeClaimTemplates !== undefined)) add('it needs a volume exactly if it has --data');
      if (doc.spec.replicas > 1 && !isShared) add('several coordinators with a volume each are several farms');
      if (doc.spec.replicas > 1 && doc.spec.updateStrategy?.type !== 'OnDelete')
        add('an update would wait for the standby');
      if (doc.spec.replicas > 1 && doc.spec.podManagementPolicy !== 'Parallel')
        add('the second would wait for the first to be ready');
    },
    Deployment: (doc, add) => {
      workloadFaults(doc, world, (...secret) => needed.push(secret), add);
      addressFaults(optionsIn(doc).get('--server'), add);
      if (doc.spec.replicas !== undefined) add("it sets replicas, but the autoscaler decides their number");
    },
    Service: (doc, add) => {
      const [workload, ...others] = selected(doc.spec.selector);
      if (workload === undefined || others.length > 0) add('its selector does not find one workload');
      for (const port of doc.spec.ports) {
        const target = workload?.spec.template.spec.containers[0].ports.find((each) => each.name === port.targetPort);
        if (target?.containerPort !== port.port)
          add(`port ${port.port} leads to ${port.targetPort}, which is ${target?.containerPort}`);
      }
    },
    PodDisruptionBudget: (doc, add) => {
      if (selected(doc.spec.selector.matchLabels).length !== 1) add('its selector does not find one workload');
      if (doc.spec.minAvailable !== undefined || ['0', 0, '0%'].includes(doc.spec.maxUnavailable))
        add('its nodes cannot be drained');
    },
    NetworkPolicy: (doc, add) => {
      const targets = selected(doc.spec.podSelector.matchLabels);
      if (targets.length !== 1) add('its selector does not find one workload');
      const peers = [
        ...(doc.spec.ingress ?? []).flatMap((rule) => rule.from ?? []),
        ...(doc.spec.egress ?? []).flatMap((rule) => rule.to ?? []),
      ];
      for (const peer of peers) {
        if (peer.podSelector && !peer.namespaceSelector && selected(peer.podSelector.matchLabels).length !== 1)
          add(`${JSON.stringify(peer.podSelector)} selects no pods`);
      }
      const ports = new Set((targets[0]?.spec.template.spec.containers[0].ports ?? []).map((port) => port.name));
      for (const {port} of (doc.spec.ingress ?? []).flatMap((rule) => rule.ports ?? []))
        if (!ports.has(port)) add(`there is no port ${port}`);
      // A worker must reach its coordinator.
      const server = targets[0] && optionsIn(targets[0]).get('--server');
      const outgoing = (doc.spec.egress ?? []).flatMap((rule) => rule.ports ?? []).map((port) => port.port);
      if (server && !outgoing.includes(portOf(server))) add(`it blocks connections to ${server}`);
      // Callers must be able to resolve names. Clusters run name servers in several places, so only the ports identify them.
      for (const port of doc.spec.egress ? [53, 5353] : []) {
        for (const protocol of ['UDP', 'TCP']) {
          const lets = (rule) => !rule.to && rule.ports?.some((each) => each.port === port && each.protocol === protocol);
          if (!doc.spec.egress.some(lets)) add(`it blocks name resolution, ${port}/${protocol}`);
        }
      }
      // KEDA, which asks for the number of workers, must reach the coordinator.
      const fromKeda = ({from, ports}) =>
        ports.some(({port}) => port === 'grpc') &&
        from.some(({namespaceSelector}) => namespaceSelector?.matchLabels?.['kubernetes.io/metadata.name'] === 'keda');
      if (doc.spec.ingress && of('ScaledObject').length > 0 && !doc.spec.ingress.some(fromKeda)) add('it blocks KEDA');
    },
    ScaledObject: (doc, add) => {
      if (named('Deployment', doc.spec.scaleTargetRef.name) === undefined) add('it scales a Deployment that does not exist');
      for (const trigger of doc.spec.triggers) {
        if (trigger.type !== 'external-push' && trigger.type !== 'external') add(`its trigger has the type ${trigger.type}`);
        addressFaults(trigger.metadata.scalerAddress, add);
        if (named('TriggerAuthentication', trigger.authenticationRef?.name) === undefined) add('it has no certificate');
      }
    },
    TriggerAuthentication: (doc, add) => {
      const given = doc.spec.secretTargetRef.map((entry) => entry.parameter).sort();
      if (given.join() !== 'caCert,tlsClientCert,tlsClientKey') add(`KEDA is given ${given}`);
      for (const {name, key} of doc.spec.secretTargetRef) needed.push([name, key]);
    },
    Namespace: () => {},
  };
  for (const doc of docs) {
    const add = (fault) => faults.push(`${nameOf(doc)}: ${fault}`);
    if (checks[doc.kind] === undefined) add('this test does not know this kind');
    else checks[doc.kind](doc, add);
  }
  for (const [name, key] of needed) {
    if (!world.secrets.get(name)?.has(key)) faults.push(`docs/operate/kubernetes.md creates no secret ${name} with ${key}`);
  }
  return faults;
}

/** Faults of a Compose file. */
function composeFarmFaults(doc, world) {
  const faults = [];
  const options = {};
  for (const [name, service] of Object.entries(doc.services)) {
    const add = (fault) => faults.push(`${name}: ${fault}`);
    const [programName, ...args] = service.command;
    const program = world.programs[programName];
    if (program === undefined) {
      add(`there is no program ${programName}`);
      continue;
    }
    const mounts = service.volumes.map((volume) => volume.split(':'));
    argumentFaults(
      program,
      args,
      mounts.map(([, target]) => target),
      add,
    );
    options[name] = optionsOf(args);
    for (const [from, target] of mounts) {
      if (!from.startsWith('.') && doc.volumes?.[from] === undefined) add(`volume ${from} is not there`);
      if (from.startsWith('./certs/') && !world.files.has(path.basename(from))) add(`docs/operate/compose.md creates no ${from}`);
      if (from.startsWith('./') && path.basename(from) !== path.basename(target)) add(`${from} is ${target}`);
    }
    if (programName === 'lightmill-worker')
      identityFaults(options[name], (state) => mounts.some(([from, target]) => target === state && !from.startsWith('.')), add);
    for (const published of service.ports ?? []) {
      const inside = Number(published.split(':').pop());
      if (!Object.keys(LISTENS).some((option) => options[name].has(option) && portOf(options[name].get(option)) === inside))
        add(`no program listens on ${inside}`);
    }
    if (service.image !== `${programName}:${world.version}`) add(`image ${service.image} for ${programName}, the version is ${world.version}`);
    if (service.user !== `${program.user}:${program.user}`) add(`it runs as ${service.user}, the image has ${program.user}`);
    if (service.read_only !== true) add('its root filesystem is writable');
    if (service.cap_drop?.[0] !== 'ALL') add('it keeps capabilities');
    if (!service.security_opt?.includes('no-new-privileges:true')) add('it may gain privileges');
    if (service.stop_grace_period !== `${program.stopSeconds}s`)
      add(`it has ${service.stop_grace_period} to stop, but ${program.stopSeconds} s as a service`);
    for (const other of service.depends_on ?? []) if (doc.services[other] === undefined) add(`there is no ${other}`);
  }
  for (const [name, given] of Object.entries(options)) {
    const server = /^\$\{LIGHTMILL_SERVER:-(.*)\}$/.exec(given.get('--server') ?? '')?.[1];
    if (
      given.has('--server') &&
      (server === undefined ||
        portOf(options[hostOf(server)]?.get('--listen') ?? ':') !== portOf(server) ||
        !world.hosts.has(hostOf(server)))
    ) {
      faults.push(`${name}: ${given.get('--server')} does not lead to the coordinator`);
    }
  }
  return faults;
}

module.exports = {composeFarmFaults, farmFaults, readWorld};
