/**
 * The editable parts of a scene: materials and lights as lists of slots. A slot has a value, and makes the scene with another value. Scenes
 * are immutable. Fields that this page does not know are kept, because messages are copied whole.
 */
import {create} from '@bufbuild/protobuf';
import {
  ColorSchema,
  Vec3Schema,
  type Camera,
  type Color,
  type Light,
  type Material,
  type Material_Medium,
  type Material_Mixture,
  type Scene,
  type Vec3,
} from '../wire/lightmill/v1/scene_pb';
import type {Pose, Vector} from './orbit';
import type {Rgb} from './tone';

interface Named {
  /** Unique in its list. */
  label: string;
}
export type Slot =
  /** A reflectance: each channel in [0, 1]; perhaps times a texture. */
  | (Named & {kind: 'color'; value: Rgb; texture: string; put: (value: Rgb) => Scene})
  /** An emission: each channel at least 0. */
  | (Named & {kind: 'light'; value: Rgb; unit: string; texture: string; put: (value: Rgb) => Scene})
  /** Three numbers with a meaning each. */
  | (Named & {kind: 'triple'; value: Vector; names: readonly [string, string, string]; least: number; most: number; put: (value: Vector) => Scene})
  | (Named & {kind: 'number'; value: number; least: number; most: number; step: number; slides: boolean; put: (value: number) => Scene})
  | (Named & {kind: 'flag'; value: boolean; put: (value: boolean) => Scene});

export interface SlotGroup {
  /** Unique in the scene. */
  title: string;
  /** "glass", "spot" and so on. */
  kind: string;
  slots: Slot[];
}

const kMaxPlace = 1e12;
const kMaxRadiance = 1e20;
const kWhite: Rgb = [1, 1, 1];
const kBlack: Rgb = [0, 0, 0];
const kAxes = ['x', 'y', 'z'] as const;
const kChannels = ['R', 'G', 'B'] as const;

/** Numbers stored as 32-bit floats, in the fewest digits that give the same float. */
function shown(value: number): number {
  const stored = Math.fround(value);
  const short = [6, 7, 8].map((digits) => Number(stored.toPrecision(digits)));
  return short.find((each) => Math.fround(each) === stored) ?? Number(stored.toPrecision(9));
}

function rgbOf(color: Color | undefined, otherwise: Rgb): Rgb {
  const kind = color?.kind;
  return kind?.case === 'rgb' ? [shown(kind.value.r), shown(kind.value.g), shown(kind.value.b)] : color?.texture ? kWhite : otherwise;
}

function withRgb(color: Color | undefined, [r, g, b]: Rgb): Color {
  const before = color?.kind.case === 'rgb' ? color.kind.value : undefined;
  return {...(color ?? create(ColorSchema)), kind: {case: 'rgb', value: {...before, $typeName: 'lightmill.v1.Color.Rgb', r, g, b}}};
}

export function vectorOf(point: Vec3 | undefined, otherwise: Vector = [0, 0, 0]): Vector {
  return point ? [point.x, point.y, point.z] : otherwise;
}

function withVector(point: Vec3 | undefined, [x, y, z]: Vector): Vec3 {
  return {...(point ?? create(Vec3Schema)), x, y, z};
}

// ---- camera ----

export function fovOf(camera: Camera | undefined): number {
  const view = camera?.view;
  if (view?.case === 'cameraConstant') {
    return (2 * Math.atan(0.5 / view.value) * 180) / Math.PI;
  }
  return view?.case === 'verticalFovDegrees' ? view.value : 45;
}

export function poseOf(camera: Camera | undefined): Pose {
  return {eye: vectorOf(camera?.eye), lookAt: vectorOf(camera?.lookAt), up: vectorOf(camera?.up, [0, 1, 0])};
}

export function withPose(scene: Scene, pose: Pose): Scene {
  const {camera} = scene;
  if (!camera) {
    return scene;
  }
  const moved = {eye: withVector(camera.eye, pose.eye), lookAt: withVector(camera.lookAt, pose.lookAt), up: withVector(camera.up, pose.up)};
  return {...scene, camera: {...camera, ...moved}};
}

export function withCamera(scene: Scene, change: Partial<Pick<Camera, 'view' | 'lensRadius' | 'focusDistance'>>): Scene {
  return scene.camera ? {...scene, camera: {...scene.camera, ...change}} : scene;
}

// ---- slots ----

type Fields = Record<string, unknown>;

/** Slots of one message: its reader, and the scene with another message in its place. */
class Slots<Message extends object> {
  readonly found: Slot[] = [];

  constructor(
    private readonly message: Message,
    private readonly place: (message: Message) => Scene,
  ) {}

  private set(field: keyof Message, value: unknown): Scene {
    return this.place({...this.message, [field]: value});
  }

  private read<T>(field: keyof Message): T | undefined {
    return (this.message as Fields)[field as string] as T | undefined;
  }

  color(field: keyof Message, label: string, otherwise: Rgb): this {
    const color = this.read<Color>(field);
    this.found.push({kind: 'color', label, value: rgbOf(color, otherwise), texture: color?.texture ?? '', put: (rgb) => this.set(field, withRgb(color, rgb))});
    return this;
  }

  light(field: keyof Message, label: string, unit: string, otherwise: Rgb = kBlack): this {
    const color = this.read<Color>(field);
    this.found.push({kind: 'light', label, unit, value: rgbOf(color, otherwise), texture: color?.texture ?? '', put: (rgb) => this.set(field, withRgb(color, rgb))});
    return this;
  }

  channels(field: keyof Message, label: string, most: number): this {
    const color = this.read<Color>(field);
    this.found.push({kind: 'triple', label, names: kChannels, least: 0, most, value: rgbOf(color, kBlack), put: ([r, g, b]) => this.set(field, withRgb(color, [r, g, b]))});
    return this;
  }

  point(field: keyof Message, label: string): this {
    const point = this.read<Vec3>(field);
    this.found.push({kind: 'triple', label, names: kAxes, least: -kMaxPlace, most: kMaxPlace, value: vectorOf(point), put: (value) => this.set(field, withVector(point, value))});
    return this;
  }

  /** In [0, 1]. */
  share(field: keyof Message, label: string, otherwise = 0): this {
    return this.number(field, label, otherwise, 0, 1, 0.01, true);
  }

  number(field: keyof Message, label: string, otherwise: number, least: number, most: number, step: number, slides = false): this {
    const value = this.read<number>(field) ?? otherwise;
    this.found.push({kind: 'number', label, value, least, most, step, slides, put: (next) => this.set(field, next)});
    return this;
  }

  flag(field: keyof Message, label: string): this {
    this.found.push({kind: 'flag', label, value: this.read<boolean>(field) ?? false, put: (value) => this.set(field, value)});
    return this;
  }
}

const kMinIor = 1e-3;
const kMaxIor = 10;

/** Slots of the material's kind itself. */
function kindSlots({kind}: Material, put: (kind: Material['kind']) => Scene): Slot[] {
  switch (kind.case) {
    case 'diffuse':
      return new Slots(kind.value, (value) => put({case: 'diffuse', value})).color('reflectance', 'Colour', kWhite).color('transmittance', 'Transmittance', kBlack).share('roughness', 'Roughness').found;
    case 'mirror':
      return new Slots(kind.value, (value) => put({case: 'mirror', value})).color('reflectance', 'Colour', kWhite).found;
    case 'dielectric':
      return new Slots(kind.value, (value) => put({case: 'dielectric', value})).number('ior', 'Index of refraction', 1.5, kMinIor, kMaxIor, 0.01).share('roughness', 'Roughness').found;
    case 'phong':
      return new Slots(kind.value, (value) => put({case: 'phong', value}))
        .color('diffuse', 'Diffuse', kBlack)
        .color('specular', 'Specular', kBlack)
        .number('exponent', 'Exponent', 10, 0, 1e6, 1).found;
    case 'conductor':
      return new Slots(kind.value, (value) => put({case: 'conductor', value})).channels('eta', 'Refraction n', 1000).channels('k', 'Extinction k', 1000).share('roughness', 'Roughness').share('anisotropy', 'Anisotropy').number('anisotropyRotationDegrees', 'Rotation of the anisotropy', 0, -1e4, 1e4, 1, true).found;
    case 'principled':
      return new Slots(kind.value, (value) => put({case: 'principled', value}))
        .color('baseColor', 'Colour', [0.8, 0.8, 0.8])
        .share('metallic', 'Metallic')
        .share('roughness', 'Roughness', 0.5)
        .share('specular', 'Specular', 0.5)
        .share('transmission', 'Transmission')
        .number('ior', 'Index of refraction', 1.5, kMinIor, kMaxIor, 0.01)
        .share('coat', 'Coat')
        .share('coatRoughness', 'Coat roughness', 0.03)
        .flag('burleyDiffuse', "Burley's diffuse part")
        .share('anisotropy', 'Anisotropy')
        .number('anisotropyRotationDegrees', 'Rotation of the anisotropy', 0, -1e4, 1e4, 1, true)
        .color('sheenColor', 'Sheen', kBlack)
        .share('sheenRoughness', 'Sheen roughness', 0.5)
        .color('transmittance', 'Transmittance', kBlack)
        .color('specularColor', 'Gloss colour', kWhite)
        .number('innerReflectance', 'Inner reflectance', 0, 0, 0.99, 0.01).found;
    case 'mixture':
      return mixtureSlots(kind.value, (value) => put({case: 'mixture', value}));
    case 'shadowCatcher':
    case undefined:
      return [];
    default:
      return kind satisfies never;
  }
}

/** The share of the second part, and the slots of both parts. */
function mixtureSlots(mixture: Material_Mixture, put: (mixture: Material_Mixture) => Scene): Slot[] {
  const partSlots = (field: 'first' | 'second', name: string): Slot[] => {
    const part = mixture[field];
    return part ? kindSlots(part, (kind) => put({...mixture, [field]: {...part, kind}})).map((slot) => ({...slot, label: `${name}: ${slot.label}`})) : [];
  };
  return [...new Slots(mixture, put).share('factor', 'Share of the second part', 0.5).found, ...partSlots('first', 'First'), ...partSlots('second', 'Second')];
}

function interiorSlots(interior: Material_Medium, put: (interior: Material_Medium) => Scene): Slot[] {
  const slots = new Slots(interior, put);
  const {density} = interior;
  if (density.case) {
    const [label, most] = density.case === 'color' ? ['Colour per unit', 1] : ['Absorption per unit', 2 ** 100];
    const value = rgbOf(density.value, kBlack);
    const at = density.case;
    slots.found.push({kind: 'triple', label: label as string, names: kChannels, least: 0, most: most as number, value, put: ([r, g, b]) => put({...interior, density: {case: at, value: withRgb(density.value, [r, g, b])}})});
  }
  return slots.channels('scattering', 'Scattering per unit', 2 ** 100).number('anisotropy', 'Anisotropy', 0, -0.99, 0.99, 0.01, true).found;
}

function materialSlots(scene: Scene, index: number): Slot[] {
  const material = scene.materials[index]!;
  const put = (changed: Material): Scene => ({...scene, materials: scene.materials.map((each, i) => (i === index ? changed : each))});
  const found = kindSlots(material, (kind) => put({...material, kind}));
  if (material.interior) {
    found.push(...interiorSlots(material.interior, (interior) => put({...material, interior})));
  }
  if (material.kind.case === 'shadowCatcher') {
    return found;  // it cannot emit light
  }
  const emission = new Slots(material, put);
  if (material.emissionFlux) {
    emission.light('emissionFlux', 'Emission', 'W');
  } else if (!material.emissionStrength) {
    emission.light('emission', 'Emission', 'W/(m² sr)');
  }
  if (material.emission || material.emissionFlux || material.emissionStrength) {
    emission.number('emissionExponent', 'Emission exponent', 0, 0, 10_000, 1).flag('twoSidedEmission', 'Emits on both sides');
  }
  return [...found, ...emission.found];
}

function lightSlots(scene: Scene, index: number): Slot[] {
  const light = scene.lights[index]!;
  const {kind} = light;
  const put = (next: Light['kind']): Scene => ({...scene, lights: scene.lights.map((each, i) => (i === index ? {...each, kind: next} : each))});
  switch (kind.case) {
    case 'point':
      return new Slots(kind.value, (value) => put({case: 'point', value})).light('intensity', 'Strength', 'W/sr').point('position', 'Position').number('radius', 'Radius', 0, 0, 2 ** 100, 0.01).found;
    case 'directional':
      return new Slots(kind.value, (value) => put({case: 'directional', value})).light('irradiance', 'Strength', 'W/m²').point('direction', 'Direction').number('angleDegrees', 'Angle, degrees', 0, 0, 180, 0.1).found;
    case 'spot':
      return new Slots(kind.value, (value) => put({case: 'spot', value}))
        .light('intensity', 'Strength', 'W/sr')
        .point('position', 'Position')
        .point('direction', 'Direction')
        .number('cutoffDegrees', 'Cutoff, degrees', 45, 0.001, 180, 1)
        .share('blend', 'Blend')
        .number('radius', 'Radius', 0, 0, 2 ** 100, 0.01).found;
    case 'cosinePower':
      return new Slots(kind.value, (value) => put({case: 'cosinePower', value}))
        .light('intensity', 'Strength', 'W/sr')
        .point('position', 'Position')
        .point('direction', 'Direction')
        .number('exponent', 'Exponent', 1, 0, 10_000, 1).found;
    case 'ies':
      return new Slots(kind.value, (value) => put({case: 'ies', value}))
        .number('scale', 'Scale', 1, 0, kMaxRadiance, 0.1)
        .color('color', 'Colour', kWhite)
        .point('position', 'Position')
        .point('direction', 'Direction').found;
    case 'disk':
      return new Slots(kind.value, (value) => put({case: 'disk', value}))
        .light('radiance', 'Strength', 'W/(m² sr)')
        .point('position', 'Position')
        .point('direction', 'Direction')
        .number('radius', 'Radius', 1, 0.001, 2 ** 100, 0.01)
        .number('spreadDegrees', 'Spread, degrees', 180, 1, 180, 1).found;
    case 'rectangle':
      return new Slots(kind.value, (value) => put({case: 'rectangle', value}))
        .light('radiance', 'Strength', 'W/(m² sr)')
        .point('position', 'Position')
        .point('direction', 'Direction')
        .number('width', 'Width', 1, 0.001, 2 ** 100, 0.01)
        .number('height', 'Height', kind.value.width ?? 1, 0.001, 2 ** 100, 0.01)
        .number('spreadDegrees', 'Spread, degrees', 180, 1, 180, 1).found;
    case 'environment':
      return new Slots(kind.value, (value) => put({case: 'environment', value}))
        .light('radiance', 'Strength', kind.value.asset ? 'times its image' : 'W/(m² sr)', kWhite)
        .number('rotationDegrees', 'Rotation, degrees', 0, -360, 360, 1).found;
    case undefined:
      return [];
    default:
      return kind satisfies never;
  }
}

const kKindNames: Record<string, string> = {dielectric: 'glass', conductor: 'metal', shadowCatcher: 'shadow catcher', cosinePower: 'cosine power', ies: 'IES'};

/** Names, with a number added where a name repeats or is missing. */
function titled(items: readonly {name: string; kind: {case?: string | undefined}}[], what: string, slotsOf: (index: number) => Slot[]): SlotGroup[] {
  const seen = new Set<string>();
  return items.map((item, i) => {
    const title = item.name && !seen.has(item.name) ? item.name : `${item.name || what} ${i + 1}`;
    seen.add(title);
    const kind = item.kind.case ?? 'unknown';
    return {title, kind: kKindNames[kind] ?? kind, slots: slotsOf(i)};
  });
}

export function materialGroups(scene: Scene): SlotGroup[] {
  return titled(scene.materials, 'Material', (i) => materialSlots(scene, i));
}

export function lightGroups(scene: Scene): SlotGroup[] {
  return titled(scene.lights, 'Light', (i) => lightSlots(scene, i));
}
