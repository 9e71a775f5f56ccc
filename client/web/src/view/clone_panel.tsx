/** Cloning a job: the same scene and settings, with another name or goal if given. */
import {useEffect, useMemo, useState} from 'preact/hooks';
import {fetchSpec, Submitter} from '../api/submit';
import {filledSpec, formOf, sceneOf, type JobForm} from '../model/job_form';
import type {JobSpec} from '../wire/lightmill/v1/farm_pb';
import {ActionButton, useOpened} from './bits';
import {JobFields} from './job_fields';
import {useFarm} from './store';

export function ClonePanel({id, onClose}: {id: bigint; onClose: () => void}) {
  const {greeting} = useFarm();
  const [spec, setSpec] = useState<JobSpec>();
  const [form, setForm] = useState<JobForm>();
  const [failure, setFailure] = useState('');
  const opened = useOpened<HTMLElement>();
  const submitter = useMemo(() => new Submitter(), []);
  useEffect(() => {
    let left = false;
    fetchSpec(id)
      .then((found) => {
        if (!left) {
          setSpec(found);
          setForm(formOf(found));
        }
      })
      .catch((error: unknown) => !left && setFailure(error instanceof Error ? error.message : String(error)));
    return () => {
      left = true;
    };
  }, [id]);
  useEffect(() => opened.current?.scrollIntoView({block: 'nearest'}), [form === undefined]);
  const submit = async () => {
    const job = await submitter.submit(filledSpec(spec!, sceneOf(spec!), form!, greeting!, spec!.parent));
    window.location.hash = `#/jobs/${job}`;
  };
  return (
    <section ref={opened} class="inset" aria-label="Clone" tabIndex={-1}>
      {form && <JobFields form={form} onForm={setForm} />}
      {!form && !failure && <p class="muted">Loading…</p>}
      <div class="actions">
        <ActionButton label="Submit the clone" refused={form ? undefined : 'The job is still loading'} act={submit} onFailure={setFailure} primary />
        <button type="button" onClick={onClose}>
          Close
        </button>
      </div>
      {failure && (
        <p class="notice failure" role="alert">
          {failure}
        </p>
      )}
    </section>
  );
}
