import {fromBinary, fromJson, toBinary} from '@bufbuild/protobuf';
import {expect, test} from 'vitest';
import {ofStrength, ofSwatch, strengthOf, swatchOf} from '../src/model/color';
import {dollied} from '../src/model/orbit';
import {fovOf, lightGroups, materialGroups, poseOf, withCamera, withPose, type Slot, type SlotGroup} from '../src/model/scene_edit';
import {SceneSchema, type Scene} from '../src/wire/lightmill/v1/scene_pb';

const rgb = (r: number, g: number, b: number) => ({rgb: {r, g, b}});
const at = (x: number, y: number, z: number) => ({x, y, z});

/** One of each kind, as packed scenes have them. */
const kJson = {
  name: 'all',
  camera: {eye: at(0, 1, 5), lookAt: at(0, 1, 0), up: at(0, 1, 0), verticalFovDegrees: 40, lensRadius: 0.1},
  film: {width: 64, height: 48, filter: {kind: 'BOX', radiusPixels: 0.5}},
  materials: [
    {name: 'wall', diffuse: {reflectance: {...rgb(0.7, 0.6, 0.5), texture: 'bricks'}}},
    {name: 'mirror', mirror: {reflectance: rgb(0.9, 0.9, 0.9)}},
    {name: 'glass', dielectric: {ior: 1.5, roughness: 0.1}, interior: {absorption: rgb(1, 2, 3), scattering: rgb(0, 0, 0), anisotropy: 0.25}},
    {name: 'plastic', phong: {diffuse: rgb(0.2, 0.2, 0.2), specular: rgb(0.3, 0.3, 0.3), exponent: 40}},
    {name: 'gold', conductor: {eta: rgb(0.1, 0.4, 1.5), k: rgb(4, 2.4, 1.6), roughness: 0.3}},
    {name: 'paint', principled: {baseColor: rgb(0.8, 0.1, 0.1), metallic: 0.5, ior: 1.4}, priority: 2},
    {name: 'worn', mixture: {first: {mirror: {reflectance: rgb(0.9, 0.8, 0.7)}}, second: {mixture: {first: {diffuse: {reflectance: rgb(0.1, 0.2, 0.3)}}, second: {phong: {exponent: 7}}}}, factor: 0.25}},
    {name: 'catcher', shadow_catcher: {}},
    {name: 'lamp', diffuse: {reflectance: rgb(0, 0, 0)}, emission: rgb(17, 12, 4), lightGroup: 'key'},
    {name: 'bulb', diffuse: {reflectance: rgb(0, 0, 0)}, emissionFlux: rgb(10, 10, 10), twoSidedEmission: true},
  ],
  textures: [{name: 'bricks', asset: 'ab'.repeat(32), filter: 'BILINEAR'}],
  objects: [{name: 'o', material: 'wall', sphere: {center: at(0, 0, 0), radius: 1}}],
  lights: [
    {name: 'p', point: {position: at(0, 2, 0), intensity: rgb(1, 2, 4)}},
    {directional: {direction: at(0, -1, 0), irradiance: rgb(1, 1, 1)}},
    {name: 's', spot: {position: at(0, 2, 0), direction: at(0, -1, 0), intensity: rgb(5, 5, 5), cutoffDegrees: 30, blend: 0.5}},
    {name: 's', cosinePower: {position: at(0, 2, 0), direction: at(0, -1, 0), intensity: rgb(5, 5, 5), exponent: 3}},
    {name: 'd', disk: {position: at(0, 2, 0), direction: at(0, -1, 0), radiance: rgb(5, 5, 5), radius: 0.3, secondRadius: 0.2, spreadDegrees: 90}},
    {name: 'r', rectangle: {position: at(0, 2, 0), direction: at(0, -1, 0), radiance: rgb(5, 5, 5), width: 0.3}},
    {name: 'i', ies: {position: at(0, 2, 0), direction: at(0, -1, 0), up: at(1, 0, 0), asset: 'cd'.repeat(32), scale: 2, color: rgb(1, 1, 1)}},
    {name: 'e', environment: {radiance: rgb(1, 1, 1), asset: 'ef'.repeat(32), rotationDegrees: 90}, group: 'sky'},
  ],
};

/** A field that this page does not know. The scene has number 1999, its first material 1998, and so on. */
const unknownField = (number: number, text: string) => ({no: number, wireType: 2, data: new Uint8Array([text.length, ...new TextEncoder().encode(text)])});

function sceneWithUnknownFields(): Scene {
  const scene = fromJson(SceneSchema, kJson as never);
  scene.$unknown = [unknownField(1999, 'from another time')];
  scene.materials[0]!.$unknown = [unknownField(1998, 'of a material')];
  (scene.materials[0]!.kind.value as {$unknown?: unknown}).$unknown = [unknownField(1997, 'of a kind')];
  (scene.lights[0]!.kind.value as {$unknown?: unknown}).$unknown = [unknownField(1996, 'of a light')];
  scene.camera!.$unknown = [unknownField(1995, 'of a camera')];
  return fromBinary(SceneSchema, toBinary(SceneSchema, scene));
}

/** A scene's leaves by path, with the bytes of unknown fields. */
function leaves(value: unknown, path = '', into = new Map<string, string>()): Map<string, string> {
  if (value instanceof Uint8Array || typeof value !== 'object' || value === null) {
    into.set(path, String(value));
  } else {
    Object.entries(value).forEach(([key, each]) => leaves(each, `${path}.${key}`, into));
  }
  return into;
}

function another(slot: Slot): Scene {
  switch (slot.kind) {
    case 'flag':
      return slot.put(!slot.value);
    case 'number':
      return slot.put(slot.value === 0.75 ? 0.5 : 0.75);
    case 'triple':
      return slot.put([0.25, 0.375, 0.875]);
    default:
      return slot.put([0.25, 0.375, 0.875]);
  }
}

const groupsOf = (scene: Scene): SlotGroup[] => [...materialGroups(scene), ...lightGroups(scene)];

test('each slot of every kind changes only its own value', () => {
  const scene = sceneWithUnknownFields();
  const before = leaves(scene);
  let slots = 0;
  groupsOf(scene).forEach((group, i) => {
    group.slots.forEach((slot, j) => {
      const changed = fromBinary(SceneSchema, toBinary(SceneSchema, another(slot)));
      const after = leaves(changed);
      const differing = [...new Set([...before.keys(), ...after.keys()])].filter((path) => before.get(path) !== after.get(path) && (after.get(path) || before.get(path)) && !path.endsWith('$typeName') && !path.endsWith('.case'));
      expect(differing.length, `${group.title}: ${slot.label}`).toBeGreaterThan(0);
      expect(differing.length, `${group.title}: ${slot.label}: ${differing}`).toBeLessThanOrEqual(3);
      expect(groupsOf(changed)[i]!.slots[j]!.value).not.toEqual(slot.value);
      ++slots;
    });
  });
  expect(leaves(scene)).toEqual(before);
  expect(slots).toBeGreaterThan(45);
  const count = (title: string) => groupsOf(scene).find((group) => group.title === title)!.slots.map((slot) => slot.label);
  expect(count('glass')).toEqual(['Index of refraction', 'Roughness', 'Absorption per unit', 'Scattering per unit', 'Anisotropy', 'Emission']);
  expect(count('paint')).toEqual(['Colour', 'Metallic', 'Roughness', 'Specular', 'Transmission', 'Index of refraction', 'Coat', 'Coat roughness', "Burley's diffuse part", 'Anisotropy', 'Rotation of the anisotropy', 'Sheen', 'Sheen roughness', 'Transmittance', 'Gloss colour', 'Inner reflectance', 'Emission']);
  expect(count('worn')).toEqual(['Share of the second part', 'First: Colour', 'Second: Share of the second part', 'Second: First: Colour', 'Second: First: Transmittance', 'Second: First: Roughness', 'Second: Second: Diffuse', 'Second: Second: Specular', 'Second: Second: Exponent', 'Emission']);
  expect(count('catcher')).toEqual([]);
  expect(count('lamp')).toEqual(['Colour', 'Transmittance', 'Roughness', 'Emission', 'Emission exponent', 'Emits on both sides']);
});

test('kinds have the names of the documents', () => {
  const kinds = materialGroups(sceneWithUnknownFields()).map(({kind}) => kind);
  expect(kinds.slice(0, 8)).toEqual(['diffuse', 'mirror', 'glass', 'phong', 'metal', 'principled', 'mixture', 'shadow catcher']);
});

test('fields that the page does not know survive every edit', () => {
  const scene = sceneWithUnknownFields();
  let edited = withPose(withCamera(scene, {view: {case: 'verticalFovDegrees', value: 20}, lensRadius: 0}), dollied(poseOf(scene.camera), 2));
  for (let i = 0; i < groupsOf(edited).length; ++i) {
    for (let j = 0; j < groupsOf(edited)[i]!.slots.length; ++j) {
      edited = another(groupsOf(edited)[i]!.slots[j]!);
    }
  }
  const text = new TextDecoder('latin1').decode(toBinary(SceneSchema, edited));
  for (const part of ['from another time', 'of a material', 'of a kind', 'of a light', 'of a camera', 'bricks', 'ab'.repeat(32), 'key', 'sky']) {
    expect(text).toContain(part);
  }
  expect(poseOf(edited.camera).eye).toEqual([0, 1, 10]);
  expect(fovOf(edited.camera)).toBe(20);
});

test('shipped scenes can be edited, and keep their bytes without an edit', () => {
  const listed = (value: unknown, keys: string[]): unknown => (Array.isArray(value) && typeof value[0] === 'number' ? Object.fromEntries(value.map((each, i) => [keys[i]!, each])) : value);
  const expanded = (value: unknown, key = ''): unknown =>
    Array.isArray(value) && typeof value[0] === 'number' && key !== 'matrix'
      ? listed(value, key === 'rgb' ? ['r', 'g', 'b'] : value.length === 2 ? ['u', 'v'] : ['x', 'y', 'z'])
      : Array.isArray(value)
        ? value.map((each) => expanded(each))
        : typeof value === 'object' && value !== null
          ? Object.fromEntries(Object.entries(value).map(([name, each]) => [name, expanded(each, name)]))
          : value;
  const files = Object.values(import.meta.glob('../../../scenes/*.json', {eager: true, import: 'default'}));
  expect(files.length).toBeGreaterThan(8);
  for (const file of files) {
    const scene = fromJson(SceneSchema, expanded(file) as never);
    const bytes = toBinary(SceneSchema, scene);
    expect(toBinary(SceneSchema, fromBinary(SceneSchema, bytes))).toEqual(bytes);
    const titles = groupsOf(scene).map((group) => group.title);
    expect(titles.length).toBeGreaterThan(0);
    expect(new Set(titles.slice(0, scene.materials.length)).size).toBe(scene.materials.length);
  }
});

test('swatches restore their colours, and strength and colour restore an emission', () => {
  // 0.5 in sRGB is 0.2140 in light.
  expect(ofSwatch('#bcbcbc')[0]).toBeCloseTo(0.5, 2);
  expect(ofSwatch('#808080')[0]).toBeCloseTo(0.2159, 3);
  expect(swatchOf([0, 1, 0.2159])).toBe('#00ff80');
  for (const swatch of ['#000000', '#ffffff', '#123456', '#fedcba']) {
    expect(swatchOf(ofSwatch(swatch))).toBe(swatch);
  }
  expect(strengthOf([17, 12, 4])).toEqual({strength: 17, color: [1, 12 / 17, 4 / 17]});
  expect(ofStrength(34, [1, 12 / 17, 4 / 17])).toEqual([34, 24, 8]);
  expect(strengthOf([0, 0, 0])).toEqual({strength: 0, color: [1, 1, 1]});
  expect(ofStrength(3, [0, 0, 0])).toEqual([3, 3, 3]);
});
