/** Dropping or choosing scenes, anywhere on the list of jobs. */
import type {ComponentChildren} from 'preact';
import {useEffect, useRef, useState} from 'preact/hooks';
import {refusalOf} from '../model/rights';
import {chosenFiles, droppedFiles, type SceneFile} from './dropped';
import {useFarm} from './store';

function holdsFiles(event: DragEvent): boolean {
  return event.dataTransfer?.types.includes('Files') ?? false;
}

export interface DropZoneProps {
  onFiles: (files: SceneFile[]) => void;
  onFailure: (message: string) => void;
  children: ComponentChildren;
}

/** Accepts drops anywhere in the window while it is mounted. */
export function DropZone({onFiles, onFailure, children}: DropZoneProps) {
  const {greeting} = useFarm();
  const refused = refusalOf(greeting, 'SubmitJob');
  const [over, setOver] = useState(false);
  const onDrop = async (transfer: DataTransfer) => {
    if (refused !== undefined) {
      return onFailure(`${refused}.`);
    }
    try {
      const files = await droppedFiles(transfer);
      if (files.length > 0) {
        onFiles(files);
      }
    } catch (error) {
      onFailure(`The dropped files cannot be read (${error instanceof Error ? error.message : String(error)}). Choose them instead.`);
    }
  };
  const latest = useRef(onDrop);
  latest.current = onDrop;
  useEffect(() => {
    const leaving = new AbortController();
    const {signal} = leaving;
    // Every element below the pointer sends enter and leave events.
    let depth = 0;
    const enter = (by: number) => (event: DragEvent) => {
      if (holdsFiles(event)) {
        depth = Math.max(depth + by, 0);
        setOver(depth > 0);
      }
    };
    const drop = (event: DragEvent) => {
      event.preventDefault();
      depth = 0;
      setOver(false);
      void latest.current(event.dataTransfer!);
    };
    addEventListener('dragenter', enter(1), {signal});
    addEventListener('dragleave', enter(-1), {signal});
    addEventListener('dragover', (event) => event.preventDefault(), {signal});
    addEventListener('drop', drop, {signal});
    return () => leaving.abort();
  }, []);
  return (
    <div class="drop-zone">
      {children}
      {over && (
        <div class="drop-hint" aria-hidden="true">
          {refused ?? 'Drop a scene with its files, or its folder'}
        </div>
      )}
    </div>
  );
}

/** The same with a file dialogue. */
export function ChooseFiles({onFiles}: {onFiles: (files: SceneFile[]) => void}) {
  const {greeting} = useFarm();
  const files = useRef<HTMLInputElement>(null);
  const folder = useRef<HTMLInputElement>(null);
  const refused = refusalOf(greeting, 'SubmitJob');
  const take = (input: HTMLInputElement) => {
    const chosen = chosenFiles(input.files);
    // So that the same files can be chosen again.
    input.value = '';
    if (chosen.length > 0) {
      onFiles(chosen);
    }
  };
  return (
    <div class="choose" role="group" aria-label="Submit a scene">
      <button type="button" class="primary" disabled={refused !== undefined} title={refused ?? 'Choose a scene and the files that it names, or drop them here'} onClick={() => files.current!.click()}>
        Submit a scene…
      </button>
      <button type="button" disabled={refused !== undefined} title={refused ?? 'Choose a folder'} onClick={() => folder.current!.click()}>
        Folder…
      </button>
      <input ref={files} class="sr-only" type="file" multiple tabIndex={-1} aria-label="Scene files" onChange={(event) => take(event.currentTarget)} />
      <input ref={folder} class="sr-only" type="file" tabIndex={-1} aria-label="A scene's folder" {...{webkitdirectory: true}} onChange={(event) => take(event.currentTarget)} />
    </div>
  );
}
