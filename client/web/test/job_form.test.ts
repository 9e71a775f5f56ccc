import {create, fromBinary, toBinary} from '@bufbuild/protobuf';
import {expect, test} from 'vitest';
import {hexOf} from '../src/model/bytes';
import {assetsOf, photonMapSpec, filledSpec, formOf, isPageJob, kMaxLivePictureSide, newSpec, livePictureSpec, sceneOf, type JobRules} from '../src/model/job_form';
import {JobSpecSchema, LayerSpec_Kind, LayerSpecSchema, type JobSpec} from '../src/wire/lightmill/v1/farm_pb';
import {SceneSchema} from '../src/wire/lightmill/v1/scene_pb';
import {MethodFactsSchema} from '../src/wire/lightmill/v1/web_pb';

const kMesh = '0f'.repeat(32);
const kImage = 'a0'.repeat(32);
const scene = create(SceneSchema, {
  name: 'room',
  camera: {eye: {z: 5}, lookAt: {}},
  film: {width: 1920, height: 1080},
  textures: [{name: 't', asset: kImage}],
  objects: [{material: 'm', shape: {case: 'mesh', value: {asset: kMesh}}}, {material: 'm', shape: {case: 'mesh', value: {asset: kMesh}}}],
  meters: [{name: 'x'}],
});
const kSurfaces = ['beauty', 'albedo', 'normal', 'features', 'depth', 'id'];
const kLight = [...kSurfaces, 'direct', 'indirect', 'bias'];
const facts = (name: string, layers: string[], more = {}) => create(MethodFactsSchema, {name, layers, maxBounces: 1_000_000, ...more});
const rules: JobRules = {
  rendererVersion: 'new',
  maxNameBytes: 200,
  methods: [
    ...['path', 'vcm'].map((name) => facts(name, kLight, {lightGroups: true, meters: true})),
    facts('caustic', [...kLight, 'caustic'], {lightGroups: true, meters: true}),
    facts('whitted', kSurfaces, {maxBounces: 8}),
    ...['ao', 'preview', 'photon-map'].map((name) => facts(name, kSurfaces)),
  ],
};
const layer = (name: string, kind = LayerSpec_Kind.SUMMED) => ({name, channels: 3, kind});
const spec: JobSpec = create(JobSpecSchema, {
  name: 'room',
  owner: 'ada',
  priority: 3,
  auditShare: 0.5,
  goal: {samples: 64n, error: 0.01},
  settings: {
    scene: toBinary(SceneSchema, scene),
    width: 1920,
    height: 1080,
    crop: {x: 480, y: 270, width: 960, height: 540},
    layers: [layer('beauty'), layer('caustic'), layer('direct'), layer('light:key'), layer('normal', LayerSpec_Kind.FIRST_MEAN)],
    seed: 18446744073709551615n,
    method: 'caustic:photons=20000',
    maxBounces: 9,
    meters: 1,
    rendererVersion: 'old',
  },
});
const names = (of: JobSpec) => of.settings!.layers.map(({name}) => name);

test("a job's form has its settings, and makes the same job again", () => {
  const form = formOf(spec);
  expect(form).toEqual({name: 'room', width: 1920, height: 1080, method: 'caustic:photons=20000', seed: 18446744073709551615n, samples: 64, seconds: 0, percent: 10, adaptive: false, denoise: false, priority: 3});
  const again = filledSpec(spec, sceneOf(spec), form, rules, 0n);
  const {assets, rendererVersion, ...rest} = again.settings!;
  expect(rest).toEqual({...spec.settings, assets: undefined, rendererVersion: undefined, ...rest});
  expect(toBinary(JobSpecSchema, {...again, settings: {...again.settings!, assets: [], rendererVersion: 'old'}})).toEqual(toBinary(JobSpecSchema, spec));
  expect(assets.map(hexOf)).toEqual([kMesh, kImage]);
  expect(rendererVersion).toBe('new');
});

test('a change of the method drops the settings that the new one does not support', () => {
  const by = (method: string) => filledSpec(spec, scene, {...formOf(spec), method}, rules, 7n);
  expect(names(by('path'))).toEqual(['beauty', 'direct', 'light:key', 'normal']);
  expect(names(by('ao:distance=0.5'))).toEqual(['beauty', 'normal']);
  expect(by('path').settings!.meters).toBe(1);
  expect(by('ao').settings!.meters).toBe(0);
  expect(by('vcm').settings!.maxBounces).toBe(9);
  expect(by('ao').settings!.maxBounces).toBe(9);
  expect(by('whitted').settings!.maxBounces).toBe(0); // its limit is 8 here
  expect(names(by('unknown'))).toEqual(['beauty']);
  expect(by('vcm').parent).toBe(7n);
});

test('a crop scales with the picture, and a picture of another shape has none', () => {
  const sized = (width: number, height: number) => {
    const {crop, scene: bytes} = filledSpec(spec, scene, {...formOf(spec), width, height}, rules, 0n).settings!;
    expect(fromBinary(SceneSchema, bytes).film).toMatchObject({width, height});
    return [crop!.x, crop!.y, crop!.width, crop!.height];
  };
  expect(sized(1920, 1080)).toEqual([480, 270, 960, 540]);
  expect(sized(960, 540)).toEqual([240, 135, 480, 270]);
  expect(sized(500, 500)).toEqual([0, 0, 500, 500]);
});

test('a live picture is small, has a higher priority, and renders the same crop', () => {
  const quick = livePictureSpec(spec, scene, formOf(spec), rules, 12n, 'preview');
  const {settings} = quick;
  expect(Math.max(settings!.width, settings!.height)).toBe(kMaxLivePictureSide);
  expect(settings).toMatchObject({width: 480, height: 270, method: 'preview', meters: 0, maxBounces: 0, crop: {x: 120, y: 67, width: 240, height: 136}});
  expect(names(quick)).toEqual(['beauty']);
  expect(quick).toMatchObject({parent: 12n, priority: 4, auditShare: 0, goal: {samples: 16n, seconds: 0, error: 0}});
  expect(assetsOf(fromBinary(SceneSchema, settings!.scene)).map(hexOf)).toEqual([kMesh, kImage]);
  const least = livePictureSpec(spec, scene, {...formOf(spec), width: 65536, height: 1, priority: 2 ** 31 - 1}, rules, 12n, 'path');
  expect([least.settings!.width, least.settings!.height, least.priority]).toEqual([480, 1, 2 ** 31 - 1]);
});

test('features are added for denoising, in the place that they have in every film', () => {
  const settings = {...spec.settings!, method: 'path', layers: [layer('beauty'), layer('normal', LayerSpec_Kind.FIRST_MEAN), layer('id', LayerSpec_Kind.FIRST_SAMPLES)].map((each) => create(LayerSpecSchema, each))};
  const filled = filledSpec({...spec, settings}, scene, {...formOf({...spec, settings}), denoise: true}, rules, 0n);
  expect(filled.settings!.layers.map(({name, channels, kind}) => [name, channels, kind])).toEqual([
    ['beauty', 3, LayerSpec_Kind.SUMMED],
    ['normal', 3, LayerSpec_Kind.FIRST_MEAN],
    ['features', 20, LayerSpec_Kind.FIRST_MEAN],
    ['id', 3, LayerSpec_Kind.FIRST_SAMPLES],
  ]);
  expect(formOf(filled).denoise).toBe(true);
  expect(names(filledSpec(filled, scene, {...formOf(filled), denoise: false}, rules, 0n))).toEqual(['beauty', 'normal', 'id']);
});

test('a new job has the size of the scene, 64 samples and the method auto, and can be denoised', () => {
  expect(formOf(newSpec(scene, 'n'))).toMatchObject({width: 1920, height: 1080, samples: 64, method: 'auto', denoise: true});
});

test('a photon map job has the size and seed of its job, and one sample', () => {
  const spec = create(JobSpecSchema, {
    name: 'box',
    priority: 3,
    auditShare: 1,
    goal: {samples: 64n, error: 0.01, adaptive: true},
    settings: {width: 64, height: 32, seed: 7n, method: 'path', maxBounces: 5, meters: 2, crop: {x: 1, y: 2, width: 3, height: 4}},
  });
  const photonMap = photonMapSpec(spec, 'caustic', rules, 12n);
  expect(photonMap.name).toBe('box (photon map)');
  const long = photonMapSpec({...spec, name: '箱'.repeat(66)}, 'few', rules, 12n).name;
  expect(long).toBe(`${'箱'.repeat(62)} (photon map)`);
  expect(new TextEncoder().encode(long).length).toBe(199); // one more character would make 202 bytes, and the limit is 200
  expect(isPageJob(photonMap.name)).toBe(true);
  expect(isPageJob('box')).toBe(false);
  expect([photonMap.parent, photonMap.priority, photonMap.auditShare]).toEqual([12n, 4, 0]);
  expect(photonMap.goal).toMatchObject({samples: 1n, error: 0, adaptive: false});
  expect(photonMap.settings).toMatchObject({width: 64, height: 32, seed: 7n, method: 'photon-map:caustic:photons=100000', maxBounces: 0, meters: 0, rendererVersion: 'new'});
  expect(photonMap.settings?.crop).toEqual(spec.settings?.crop);
});
