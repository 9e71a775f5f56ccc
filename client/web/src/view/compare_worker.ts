/** A web worker that measures pictures, so that the page's thread can draw. */
import {commonPixels, errorsBetween, meanOver, onlyCommon, type Measured, type PictureErrors} from '../model/comparison';
import {flipMap, hdrFlipMap} from '../model/flip';

export interface Question {
  width: number;
  height: number;
  picture: Measured;
  reference: Measured;
  hdr: boolean;
  /** Stops; used by FLIP, not by HDR-FLIP. */
  exposure: number;
}

/** FLIP at each pixel, and its mean. */
export interface FlipAnswer {
  map: Float32Array<ArrayBuffer>;
  mean: number;
}

/** Sent twice: the errors at once, then the same with FLIP. */
export interface Answer {
  /** Undefined if no pixel counts. */
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
