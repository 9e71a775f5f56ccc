/** The measured difference of two films, updated as they change. */
import {useEffect, useRef, useState} from 'preact/hooks';
import type {PictureErrors} from '../model/comparison';
import type {Film} from '../model/film';
import type {Answer, FlipAnswer, Question} from './compare_worker';
import {useFilmVersion} from './inspector';

/** Larger pictures are not measured. */
export const kMaxMeasuredPixels = 16_777_216;

export interface Measurement {
  /** Undefined if no pixel counts. */
  errors: PictureErrors | undefined;
  /** Undefined until it is computed; then for one exposure, or for all (HDR). */
  flip: (FlipAnswer & {hdr: boolean; exposure: number}) | undefined;
}

function canMeasure(film: Film, other: Film): boolean {
  const pixels = film.crop.width * film.crop.height;
  return film.crop.width === other.crop.width && film.crop.height === other.crop.height && pixels <= kMaxMeasuredPixels;
}

/** Runs one measurement at a time, of the newest request. Afterwards it pauses for as long as the measurement took. */
class Measurer {
  private readonly worker = new Worker(new URL('./compare_worker.ts', import.meta.url), {type: 'module'});
  private asked: {at: number; hdr: boolean; exposure: number} | undefined;
  private rest: ReturnType<typeof setTimeout> | undefined;
  private waiting: (() => Question) | undefined;

  constructor(onAnswer: (measurement: Measurement) => void) {
    this.worker.onmessage = ({data}: MessageEvent<Answer>) => {
      const {at, hdr, exposure} = this.asked!;
      onAnswer({...data, flip: data.flip && {...data.flip, hdr, exposure}});
      if (data.flip) {
        this.rest = setTimeout(() => {
          this.asked = undefined;
          this.next();
        }, performance.now() - at);
      }
    };
  }

  ask(question: () => Question): void {
    this.waiting = question;
    this.next();
  }

  close(): void {
    clearTimeout(this.rest);
    this.worker.terminate();
  }

  private next(): void {
    const question = this.asked ? undefined : this.waiting?.();
    if (question) {
      this.waiting = undefined;
      this.asked = {at: performance.now(), hdr: question.hdr, exposure: question.exposure};
      const {picture, reference} = question;
      this.worker.postMessage(question, [picture.rgb.buffer, picture.known.buffer, reference.rgb.buffer, reference.known.buffer]);
    }
  }
}

/** Undefined until the first result. */
export function useMeasurement(film: Film | undefined, other: Film | undefined, hdr: boolean, exposure: number): Measurement | undefined {
  const [measurement, setMeasurement] = useState<Measurement>();
  const versions = [useFilmVersion(film, 1_000), useFilmVersion(other, 1_000)];
  const measurer = useRef<Measurer>();
  const comparing = film !== undefined && other !== undefined;
  useEffect(() => {
    if (!comparing) {
      return;
    }
    // FLIP takes longest, so the last FLIP stays until the next one.
    measurer.current = new Measurer((next) => setMeasurement((before) => ({errors: next.errors, flip: next.flip ?? before?.flip})));
    return () => {
      measurer.current!.close();
      setMeasurement(undefined);
    };
  }, [film, other, comparing]);
  useEffect(() => {
    if (film && other && canMeasure(film, other)) {
      const {width, height} = film.crop;
      measurer.current!.ask(() => ({width, height, picture: film.planes(), reference: other.planes(), hdr, exposure: hdr ? 0 : exposure}));
    }
  }, [film, other, hdr, hdr ? 0 : exposure, ...versions]);
  return measurement;
}
