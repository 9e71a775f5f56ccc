/** A worker's report on scene files that the farm has. */
import {fromJson, type JsonValue} from '@bufbuild/protobuf';
import {base64Of} from '../model/bytes';
import {SceneSchema, type Scene} from '../wire/lightmill/v1/scene_pb';
import {ActionError, post} from './actions';

export interface NamedDigest {
  path: string;
  digest: Uint8Array;
}

export interface Inspection {
  /** The packed scene. Its meshes and images are assets that the farm has. */
  scene: Scene;
  notices: string[];
  facts: {what: string; value: string}[];
  methods: {method: string; admitted: boolean; reason: string}[];
  /** The choice of auto, or the candidates of its pilot. */
  chosen: string[];
  cameras: string[];
}

interface Answer extends Partial<Omit<Inspection, 'scene'>> {
  scene?: JsonValue;
}

/** `camera`: a name; empty: the scene's own. */
export async function inspectScene(files: readonly NamedDigest[], scene: readonly string[], camera: string, signal: AbortSignal): Promise<Inspection> {
  const named = files.map(({path, digest}) => ({path, digest: base64Of(digest)}));
  const {scene: found, notices = [], facts = [], methods = [], chosen = [], cameras = []} = (await post('inspect', {files: named, scene, camera}, {signal})) as Answer;
  if (!found) {
    throw new ActionError('the farm found no scene in these files');
  }
  return {scene: fromJson(SceneSchema, found, {ignoreUnknownFields: true}), notices, facts, methods, chosen, cameras};
}
