/** The form of a job, and the job made of it: an edited one, a clone, or one for a live picture. Pure. */
import {create, fromBinary, toBinary} from '@bufbuild/protobuf';
import {
  GoalSchema,
  JobSpecSchema,
  LayerSpec_Kind,
  LayerSpecSchema,
  PixelRectSchema,
  RenderSettingsSchema,
  type JobSpec,
  type LayerSpec,
  type RenderSettings,
} from '../wire/lightmill/v1/farm_pb';
import {SceneSchema, type Scene} from '../wire/lightmill/v1/scene_pb';
import type {FarmGreeting, MethodFacts} from '../wire/lightmill/v1/web_pb';
import {bytesOfHex} from './bytes';
import type {Photons} from './route';

export const kMinPriority = -(2 ** 31);
export const kMaxPriority = 2 ** 31 - 1;

/** What the coordinator says of jobs. */
export type JobRules = Pick<FarmGreeting, 'rendererVersion' | 'methods' | 'maxNameBytes'>;

export interface JobForm {
  name: string;
  width: number;
  height: number;
  /** With its parameters, e.g. "caustic:photons=20000". */
  method: string;
  seed: bigint;
  /** 0: no limit; the same for the next two. */
  samples: number;
  seconds: number;
  /** The error in percent: ±1% is the relMSE 0.0001. */
  percent: number;
  adaptive: boolean;
  /** Whether the film gets the layer `features`, so that its picture can be denoised. */
  denoise: boolean;
  priority: number;
}

export function formOf(spec: JobSpec): JobForm {
  const {settings, goal} = spec;
  return {
    name: spec.name,
    width: settings?.width ?? 512,
    height: settings?.height ?? 512,
    method: settings?.method ?? 'auto',
    seed: settings?.seed ?? 0n,
    samples: Number(goal?.samples ?? 0n),
    seconds: goal?.seconds ?? 0,
    percent: Number((100 * Math.sqrt(goal?.error ?? 0)).toPrecision(9)),
    adaptive: goal?.adaptive ?? false,
    denoise: settings?.layers.some(({name}) => name === kFeatures.name) ?? false,
    priority: spec.priority,
  };
}

export function sceneOf(spec: JobSpec): Scene {
  return fromBinary(SceneSchema, spec.settings?.scene ?? new Uint8Array());
}

const kBeauty: LayerSpec = create(LayerSpecSchema, {name: 'beauty', channels: 3, kind: LayerSpec_Kind.SUMMED});

const kFeatures: LayerSpec = create(LayerSpecSchema, {name: 'features', channels: 20, kind: LayerSpec_Kind.FIRST_MEAN});
/** The layers that come after features in every film. */
const kLastLayers: readonly string[] = ['depth', 'id'];

/** The layers in the film's order, with features or without. */
function withFeatures(layers: readonly LayerSpec[], wanted: boolean): LayerSpec[] {
  const others = layers.filter(({name}) => name !== kFeatures.name);
  const [first, last] = [others.filter(({name}) => !kLastLayers.includes(name)), others.filter(({name}) => kLastLayers.includes(name))];
  return wanted ? [...first, kFeatures, ...last] : others;
}

/** The facts about a method, e.g. of "path:brute-force". Undefined if the coordinator does not know it. */
function factsOf({methods}: JobRules, method: string): MethodFacts | undefined {
  const name = method.split(':')[0]!;
  return methods.find((facts) => facts.name === name);
}

/** The requested layers that the method has. */
function layersFor(facts: MethodFacts | undefined, layers: readonly LayerSpec[]): LayerSpec[] {
  const kept = layers.filter(({name}) => name === 'beauty' || facts?.layers.includes(name) || (facts?.lightGroups && name.startsWith('light:')));
  return kept.length > 0 ? kept : [kBeauty];
}

/** The assets of a packed scene, sorted, without duplicates. */
export function assetsOf(scene: Scene): Uint8Array[] {
  const named = new Set<string>();
  scene.textures.forEach(({asset}) => named.add(asset));
  scene.objects.forEach(({shape}) => shape.case === 'mesh' && named.add(shape.value.asset));
  scene.lights.forEach(({kind}) => (kind.case === 'ies' || kind.case === 'environment') && named.add(kind.value.asset));
  named.delete('');
  return [...named].sort().map(bytesOfHex);
}

/** The crop is scaled if the new size is a multiple or a fraction of the old one. Otherwise it is the whole film. */
function cropFor({crop, width, height}: RenderSettings, to: {width: number; height: number}) {
  if (crop && width === to.width && height === to.height) {
    return crop;
  }
  if (!crop || (crop.width === width && crop.height === height) || Math.abs(to.width / width - to.height / height) * Math.max(width, height) > 1) {
    return create(PixelRectSchema, {x: 0, y: 0, width: to.width, height: to.height});
  }
  const scale = to.width / width;
  const [x, y] = [Math.floor(crop.x * scale), Math.floor(crop.y * scale)];
  const right = Math.min(Math.ceil((crop.x + crop.width) * scale), to.width);
  const bottom = Math.min(Math.ceil((crop.y + crop.height) * scale), to.height);
  return create(PixelRectSchema, {x, y, width: Math.max(right - x, 1), height: Math.max(bottom - y, 1)});
}

function settingsFor(before: RenderSettings, scene: Scene, form: Pick<JobForm, 'width' | 'height' | 'method' | 'seed' | 'denoise'>, rules: JobRules): RenderSettings {
  const method = form.method.trim();
  const facts = factsOf(rules, method);
  const film = scene.film && {...scene.film, width: form.width, height: form.height};
  return {
    ...before,
    scene: toBinary(SceneSchema, film ? {...scene, film} : scene),
    assets: assetsOf(scene),
    width: form.width,
    height: form.height,
    crop: cropFor(before, form),
    layers: layersFor(facts, withFeatures(before.layers, form.denoise)),
    seed: form.seed,
    method,
    maxBounces: facts && before.maxBounces <= facts.maxBounces ? before.maxBounces : 0,
    meters: facts?.meters ? scene.meters.length : 0,
    rendererVersion: rules.rendererVersion,
  };
}

/** The form's job for `scene`. Other fields come from `spec`. `parent`: 0n is none. */
export function filledSpec(spec: JobSpec, scene: Scene, form: JobForm, rules: JobRules, parent: bigint): JobSpec {
  return {
    ...spec,
    name: form.name,
    parent,
    priority: form.priority,
    goal: {...(spec.goal ?? create(GoalSchema)), samples: BigInt(form.samples), seconds: form.seconds, error: Number(((form.percent / 100) ** 2).toPrecision(12)), adaptive: form.adaptive},
    settings: settingsFor(spec.settings ?? create(RenderSettingsSchema), scene, form, rules),
  };
}

/** The first spec for a scene that was read from files. Its picture can be denoised. */
export function newSpec(scene: Scene, name: string): JobSpec {
  const [width, height] = [scene.film?.width ?? 512, scene.film?.height ?? 512];
  const settings = create(RenderSettingsSchema, {width, height, method: 'auto', layers: withFeatures([kBeauty], true)});
  return create(JobSpecSchema, {name, goal: {samples: 64n}, settings});
}

/** Suffix of the names of live pictures' jobs. */
export const kLivePictureEnding = ' (being edited)';

/** Suffix of the names of jobs that render photons for the overlay. */
export const kPhotonMapEnding = ' (photon map)';

/** The name, cut so that the ending fits. */
function pageJobName(name: string, ending: string, {maxNameBytes}: JobRules): string {
  const room = maxNameBytes - ending.length;
  let cut = '';
  for (const character of name || 'scene') {
    if (new TextEncoder().encode(cut + character).length > room) {
      break;
    }
    cut += character;
  }
  return cut + ending;
}

/** Whether the job belongs to a page, which deletes it. */
export function isPageJob(name: string): boolean {
  return name.endsWith(kLivePictureEnding) || name.endsWith(kPhotonMapEnding);
}

const kPhotonMapMethods: Record<Exclude<Photons, 'none'>, string> = {
  few: 'photon-map:photons=10000',
  many: 'photon-map:photons=100000',
  caustic: 'photon-map:caustic:photons=100000',
};

/** The photons of a job's scene, aligned with its pixels. One sample is enough, since all show the same. */
export function photonMapSpec(spec: JobSpec, photons: Exclude<Photons, 'none'>, rules: JobRules, parent: bigint): JobSpec {
  const {settings} = spec;
  return {
    ...spec,
    name: pageJobName(spec.name, kPhotonMapEnding, rules),
    parent,
    priority: Math.min(spec.priority + 1, kMaxPriority),
    auditShare: 0,
    goal: create(GoalSchema, {samples: 1n}),
    settings: {...(settings ?? create(RenderSettingsSchema)), method: kPhotonMapMethods[photons], layers: [kBeauty], maxBounces: 0, meters: 0, rendererVersion: rules.rendererVersion},
  };
}

export type LivePictureMethod = 'preview' | 'raycast' | 'path';
/** Samples of a live picture: enough for smooth edges, or for a first impression of the light. */
const kLivePictureSamples: Record<LivePictureMethod, bigint> = {preview: 16n, raycast: 16n, path: 64n};
export const kMaxLivePictureSide = 480;

/** The job of a live picture of a scene during editing: small, with high priority, without audits, of the job's whole picture. */
export function livePictureSpec(spec: JobSpec, scene: Scene, form: JobForm, rules: JobRules, parent: bigint, method: LivePictureMethod): JobSpec {
  const scale = Math.min(1, kMaxLivePictureSide / Math.max(form.width, form.height));
  const side = (length: number) => Math.max(1, Math.round(length * scale));
  const small = {...form, width: side(form.width), height: side(form.height), method};
  const whole = settingsFor(spec.settings ?? create(RenderSettingsSchema), scene, form, rules);
  return {
    ...spec,
    name: pageJobName(form.name, kLivePictureEnding, rules),
    parent,
    priority: Math.min(form.priority + 1, kMaxPriority),
    auditShare: 0,
    goal: create(GoalSchema, {samples: kLivePictureSamples[method]}),
    settings: {...settingsFor(whole, scene, small, rules), layers: [kBeauty], maxBounces: 0, meters: 0},
  };
}
