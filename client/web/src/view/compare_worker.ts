/** Measures pictures away from the page's own thread, which goes on drawing. */
import {commonPixels, errorsBetween, meanOver, onlyCommon, type Measured, type PictureErrors} from '../model/comparison';
import {flipMap, hdrFlipMap} from '../model/flip';

export interface Question {
  width: number;
  height: number;
  picture: Measured;
  reference: Measured;
  hdr: boolean;
  /** Stops; of FLIP that is not HDR. */
  exposure: number;
}

/** Of FLIP at each pixel, and its mean. */
export interface FlipAnswer {
  map: Float32Array<ArrayBuffer>;
  mean: number;
}

/** Two of them: the errors at once, then, later, the same with FLIP. */
export interface Answer {
  /** Undefined where no pixel counts. */
  errors: PictureErrors | undefined;
  flip: FlipAnswer | undefined;
}

self.onmessage = ({data}: MessageEvent<Question>) => {
  const {width, height, picture, reference, hdr, exposure} = data;
  const common = commonPixels(picture, reference);
  const errors = errorsBetween(picture, reference, common);
  const first: Answer = {errors, flip: undefined};
  self.postMessage(first);
  const shown = [picture, reference].map((each) => ({width, height, rgb: onlyCommon(each, common)}));
  const map = hdr ? hdrFlipMap(shown[0]!, shown[1]!) : flipMap(shown[0]!, shown[1]!, exposure);
  const flip: FlipAnswer = {map: map as Float32Array<ArrayBuffer>, mean: meanOver(map, common)};
  const second: Answer = {errors, flip};
  self.postMessage(second, {transfer: [flip.map.buffer]});
};
