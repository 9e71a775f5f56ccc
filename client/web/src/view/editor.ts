/** The editor of a job: scene and form, their undo history, and the live picture. */
import {useEffect, useMemo, useRef, useState} from 'preact/hooks';
import {fetchSpec} from '../api/submit';
import type {Film} from '../model/film';
import {formOf, livePictureSpec, sceneOf, type JobForm, type LivePictureMethod} from '../model/job_form';
import {dollied, orbited, panned} from '../model/orbit';
import {fovOf, poseOf, withPose} from '../model/scene_edit';
import {begun, edited, redone, settled, undone, type Edits} from '../model/undo';
import type {JobSpec} from '../wire/lightmill/v1/farm_pb';
import type {Scene} from '../wire/lightmill/v1/scene_pb';
import {useLivePicture} from './live_picture';
import {useFarm} from './store';
import type {Steering} from './viewer';

export interface Draft {
  scene: Scene;
  form: JobForm;
}

export interface Editor {
  spec: JobSpec;
  edits: Edits<Draft>;
  set: (change: Partial<Draft>, of: string) => void;
  undo: () => void;
  redo: () => void;
  reset: () => void;
  /** The method of the live picture. */
  liveMethod: LivePictureMethod;
  setLiveMethod: (liveMethod: LivePictureMethod) => void;
  /** The live picture; undefined until it arrives. */
  film: Film | undefined;
  /** Why there is no live picture. */
  failure: string;
  steering: Steering;
}

type Change = (edits: Edits<Draft>) => Edits<Draft>;

function steeringOf(change: (by: Change) => void): Steering {
  const steer = (move: (scene: Scene) => Scene) => change((edits) => edited(edits, {...edits.now, scene: move(edits.now.scene)}, 'camera'));
  return {
    // The scene follows the finger. A drag over the picture's height rotates it by 180 degrees.
    orbit: (x, y) => steer((scene) => withPose(scene, orbited(poseOf(scene.camera), -x * Math.PI, y * Math.PI))),
    pan: (x, y) => steer((scene) => withPose(scene, panned(poseOf(scene.camera), fovOf(scene.camera), x, y))),
    dolly: (factor) => steer((scene) => withPose(scene, dollied(poseOf(scene.camera), factor))),
    release: () => change(settled),
  };
}

/** Undefined unless `editing`, and until the job's scene arrives. `failure` says why it cannot. */
export function useEditor(id: bigint, editing: boolean): {editor: Editor | undefined; failure: string} {
  const {greeting} = useFarm();
  const [spec, setSpec] = useState<JobSpec>();
  const [edits, setEdits] = useState<Edits<Draft>>();
  const [liveMethod, setLiveMethod] = useState<LivePictureMethod>('raycast');
  const [failure, setFailure] = useState('');
  useEffect(() => {
    if (!editing) {
      return;
    }
    let left = false;
    fetchSpec(id)
      .then((found) => {
        if (!left) {
          setSpec(found);
          setEdits(begun({scene: sceneOf(found), form: formOf(found)}));
        }
      })
      .catch((error: unknown) => !left && setFailure(error instanceof Error ? error.message : String(error)));
    return () => {
      left = true;
      setSpec(undefined);
      setEdits(undefined);
      setFailure('');
    };
  }, [id, editing]);
  const change = useRef((by: Change) => setEdits((before) => before && by(before))).current;
  const steering = useMemo(() => steeringOf(change), []);
  const draft = edits?.now;
  // Name and goal do not change the picture.
  const {width, height, seed, priority} = draft?.form ?? {};
  const request = useMemo(
    () => (spec && draft && greeting ? livePictureSpec(spec, draft.scene, draft.form, greeting, id, liveMethod) : undefined),
    [spec, draft?.scene, width, height, seed, priority, greeting, liveMethod],
  );
  const {film, failure: noPicture} = useLivePicture(request);
  if (!spec || !edits) {
    return {editor: undefined, failure};
  }
  const editor: Editor = {
    spec,
    edits,
    set: (next, of) => change((before) => edited(before, {...before.now, ...next}, of)),
    undo: () => change(undone),
    redo: () => change(redone),
    reset: () => change((before) => edited(before, before.first, '')),
    liveMethod,
    setLiveMethod,
    film,
    failure: noPicture,
    steering,
  };
  return {editor, failure};
}
