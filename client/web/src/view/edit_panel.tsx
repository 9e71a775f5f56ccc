/** Editing of a job's camera, materials, lights and settings, and the new job made of them. */
import {useEffect, useMemo, useState} from 'preact/hooks';
import {Submitter} from '../api/submit';
import {filledSpec, type LivePictureMethod} from '../model/job_form';
import type {Vector} from '../model/orbit';
import {fovOf, lightGroups, materialGroups, poseOf, withCamera, withPose} from '../model/scene_edit';
import type {Scene} from '../wire/lightmill/v1/scene_pb';
import {ActionButton, useOpened} from './bits';
import {SlotGroups, TripleField} from './edit_fields';
import type {Editor} from './editor';
import {JobFields} from './job_fields';
import {NumberField} from './number_field';
import {useFarm} from './store';

const kLiveLabels: [LivePictureMethod, string][] = [
  ['preview', 'Flat colours'],
  ['raycast', 'Hard shadows'],
  ['path', 'All light, noisy'],
];
const kAxes = ['x', 'y', 'z'] as const;

function CameraFields({scene, onScene}: {scene: Scene; onScene: (scene: Scene, of: string) => void}) {
  const pose = poseOf(scene.camera);
  const round = (value: number) => Number(value.toPrecision(7));
  // Components that were not edited keep all their digits.
  const changed = (before: Vector, after: Vector) => before.map((value, i) => (after[i] === round(value) ? value : after[i])) as unknown as Vector;
  const point = (key: keyof typeof pose, label: string) => (
    <div class="slot" role="group" aria-label={label}>
      <span class="slot-name">{label}</span>
      <TripleField label={label} names={kAxes} value={pose[key].map(round) as unknown as Vector} onValue={(value) => onScene(withPose(scene, {...pose, [key]: changed(pose[key], value)}), `camera/${key}`)} />
    </div>
  );
  const number = (label: string, value: number, most: number, put: (value: number) => Scene, least = 0) => (
    <div class="slot">
      <span class="slot-name">{label}</span>
      <NumberField class="short" label={label} step={least || 0.1} least={least} most={most} value={Number(value.toPrecision(7))} onValue={(next) => onScene(put(next), `camera/${label}`)} />
    </div>
  );
  return (
    <div class="slots">
      {point('eye', 'Position')}
      {point('lookAt', 'Look at')}
      {point('up', 'Up')}
      {number('Field of view, degrees', fovOf(scene.camera), 179, (value) => withCamera(scene, {view: {case: 'verticalFovDegrees', value}}), 0.1)}
      {number('Lens radius', scene.camera?.lensRadius ?? 0, 1e12, (lensRadius) => withCamera(scene, {lensRadius}))}
      {(scene.camera?.lensRadius ?? 0) > 0 && number('Focus distance (0: look-at point)', scene.camera?.focusDistance ?? 0, 1e12, (focusDistance) => withCamera(scene, {focusDistance}))}
    </div>
  );
}

/** Ctrl+Z undoes. With Shift, or as Ctrl+Y, it redoes. Fields have an undo of their own while the user types. */
function useUndoKeys({undo, redo}: Editor) {
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      const typing = event.target instanceof HTMLInputElement && !['range', 'color', 'checkbox'].includes(event.target.type);
      const key = event.key.toLowerCase();
      if (typing || event.altKey || !(event.ctrlKey || event.metaKey) || (key !== 'z' && key !== 'y')) {
        return;
      }
      event.preventDefault();
      (key === 'y' || event.shiftKey ? redo : undo)();
    };
    window.addEventListener('keydown', onKey);
    return () => window.removeEventListener('keydown', onKey);
  }, [undo, redo]);
}

export interface EditPanelProps {
  id: bigint;
  editor: Editor;
  onClose: () => void;
}

export function EditPanel({id, editor, onClose}: EditPanelProps) {
  const {greeting} = useFarm();
  const [failure, setFailure] = useState('');
  const opened = useOpened<HTMLElement>();
  const submitter = useMemo(() => new Submitter(), []);
  const {edits, spec} = editor;
  const {scene, form} = edits.now;
  const materials = useMemo(() => materialGroups(scene), [scene]);
  const lights = useMemo(() => lightGroups(scene), [scene]);
  useUndoKeys(editor);
  const onScene = (next: Scene, of: string) => editor.set({scene: next}, of);
  const render = async () => {
    const job = await submitter.submit(filledSpec(spec, scene, form, greeting!, id));
    window.location.hash = `#/jobs/${job}`;
  };
  return (
    <section ref={opened} class="panel edit-panel" aria-labelledby="edit-title" tabIndex={-1}>
      <h2 id="edit-title">Edit & render again</h2>
      <div class="edit-tools">
        <button type="button" disabled={edits.past.length === 0} title="Ctrl+Z" onClick={editor.undo}>
          Undo
        </button>
        <button type="button" disabled={edits.future.length === 0} title="Ctrl+Shift+Z" onClick={editor.redo}>
          Redo
        </button>
        <button type="button" disabled={edits.past.length === 0} title="Undo all changes" onClick={editor.reset}>
          Reset
        </button>
        <span class="spacer" />
        <button type="button" onClick={onClose}>
          Close
        </button>
      </div>
      <label class="live-picture">
        Live picture
        <select value={editor.liveMethod} onChange={(event) => editor.setLiveMethod(event.currentTarget.value as LivePictureMethod)}>
          {kLiveLabels.map(([method, label]) => (
            <option key={method} value={method}>
              {label}
            </option>
          ))}
        </select>
      </label>
      {editor.failure && (
        <p class="notice failure" role="alert">
          No live picture: {editor.failure}
        </p>
      )}
      <details open>
        <summary>Camera</summary>
        <CameraFields scene={scene} onScene={onScene} />
      </details>
      <details>
        <summary>
          Materials <span class="count">{materials.length}</span>
        </summary>
        <SlotGroups groups={materials} none="The scene has no materials." onScene={onScene} />
      </details>
      <details>
        <summary>
          Lights <span class="count">{lights.length}</span>
        </summary>
        <SlotGroups groups={lights} none="The scene has no lights. Its light comes from emissive materials." onScene={onScene} />
      </details>
      <details>
        <summary>Settings</summary>
        <JobFields form={form} onForm={(next, of) => editor.set({form: next}, `form/${of}`)} />
      </details>
      <div class="actions">
        <ActionButton label="Render" title="Submit the change as a new job" act={render} onFailure={setFailure} primary />
      </div>
      {failure && (
        <p class="notice failure" role="alert">
          {failure}
        </p>
      )}
    </section>
  );
}
