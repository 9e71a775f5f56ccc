/** The live picture during editing, and its job, over a connection of its own. */
import {useEffect, useRef, useState} from 'preact/hooks';
import {Live} from '../api/live';
import {discardJob, Submitter} from '../api/submit';
import {Film} from '../model/film';
import {LivePicture} from '../model/live_picture';
import {JobState, type JobSpec} from '../wire/lightmill/v1/farm_pb';
import {farm} from './store';

/** A job is not replaced before its picture is complete, or this time has passed. */
const kPictureMs = 1_500;

class LivePreview {
  private film: Film | undefined;
  private job = 0n;
  private spec: JobSpec | undefined;
  private onPicture = () => {};
  /** Why the job failed. */
  private fault = '';
  private readonly submitter = new Submitter(true);
  private readonly live = new Live({
    onLink: () => undefined,
    onUpdate: ({job, tiles, jobFailure}) => {
      if (jobFailure && this.spec && this.picture.current === this.job) {
        this.picture.want(this.spec); // it was deleted while the page was not connected
      }
      if (job && this.spec && this.film?.job === job.id && !this.film.isOf(job)) {
        // Another farm answers, and the job with this number is not the page's.
        this.film = undefined;
        this.job = 0n;
        this.picture.forget();
        this.picture.want(this.spec);
        this.onPicture();
      } else if (job && job.id === this.job) {
        this.film ??= Film.of(job);
        if (job.state === JobState.FAILED) {
          this.fault = job.reason;
          this.onFailure(job.reason);
          this.onPicture();
        }
      }
      farm.putTiles(this.film, tiles);
      if (this.film?.counts.every((count) => count > 0)) {
        this.onFilm(this.film);
        this.onPicture();
      }
    },
  });
  readonly picture: LivePicture<JobSpec>;

  constructor(
    private readonly onFilm: (film: Film) => void,
    private readonly onFailure: (message: string) => void,
  ) {
    this.picture = new LivePicture<JobSpec>({submit: (spec) => this.submit(spec), discard: (job) => discardJob(job)}, {onJob: () => undefined, onFailure});
  }

  close(): void {
    this.live.close();
    this.onPicture();
    // A job that could not be deleted stays in the list of jobs, where users can delete it.
    void this.picture.close().catch(() => undefined);
  }

  private async submit(spec: JobSpec): Promise<bigint> {
    const job = await this.submitter.submit(spec);
    this.job = job;
    this.spec = spec;
    this.film = undefined;
    this.fault = '';
    this.live.want({jobs: false, workers: false, job});
    await new Promise<void>((resolve) => {
      this.onPicture = resolve;
      setTimeout(resolve, kPictureMs);
    });
    if (this.job !== job) {
      throw new Error('another farm answers now');
    }
    if (this.fault) {
      await discardJob(job);
      throw new Error(this.fault);
    }
    return job;
  }
}

/** The picture of the newest request that has one, and why a newer request has none. None while `request` is undefined. */
export function useLivePicture(request: JobSpec | undefined): {film: Film | undefined; failure: string} {
  const [film, setFilm] = useState<Film>();
  const [failure, setFailure] = useState('');
  const picture = useRef<LivePreview>();
  const wanted = request !== undefined;
  useEffect(() => {
    if (!wanted) {
      return;
    }
    const now = new LivePreview(setFilm, setFailure);
    picture.current = now;
    return () => {
      now.close();
      setFilm(undefined);
      setFailure('');
    };
  }, [wanted]);
  useEffect(() => {
    if (request) {
      picture.current?.picture.want(request);
    }
  }, [request]);
  return {film, failure};
}
