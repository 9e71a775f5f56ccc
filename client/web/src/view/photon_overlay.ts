/** The photon overlay: photons rendered by a small job of the same scene, camera and size. */
import {useEffect, useMemo, useState} from 'preact/hooks';
import {fetchSpec} from '../api/submit';
import type {Film} from '../model/film';
import {photonMapSpec} from '../model/job_form';
import type {Photons} from '../model/route';
import type {JobSpec} from '../wire/lightmill/v1/farm_pb';
import {useLivePicture} from './live_picture';
import {useFarm} from './store';

/** No film if no photons are wanted, or before they arrive. `failure` says why they cannot. */
export function usePhotonOverlay(id: bigint, photons: Photons): {film: Film | undefined; failure: string} {
  const {greeting} = useFarm();
  const [spec, setSpec] = useState<JobSpec>();
  const [failure, setFailure] = useState('');
  const wanted = photons !== 'none';
  useEffect(() => {
    if (!wanted) {
      return;
    }
    let left = false;
    fetchSpec(id)
      .then((found) => !left && setSpec(found))
      .catch((error: unknown) => !left && setFailure(error instanceof Error ? error.message : String(error)));
    return () => {
      left = true;
      setSpec(undefined);
      setFailure('');
    };
  }, [id, wanted]);
  const request = useMemo(() => (spec && greeting && photons !== 'none' ? photonMapSpec(spec, photons, greeting, id) : undefined), [spec, greeting, photons, id]);
  const {film, failure: notRendered} = useLivePicture(request);
  return {film, failure: failure || notRendered};
}
