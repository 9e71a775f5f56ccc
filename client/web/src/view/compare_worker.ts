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

export interface Answer {
  /** Undefined where no pixel counts. */
  errors: PictureErrors | undefined;
  map: Float32Array<ArrayBuffer>;
  flip: number;
}

self.onmessage = ({data}: MessageEvent<Question>) => {
  const {width, height, picture, reference, hdr, exposure} = data;
  const common = commonPixels(picture, reference);
  const shown = [picture, reference].map((each) => ({width, height, rgb: onlyCommon(each, common)}));
  const map = hdr ? hdrFlipMap(shown[0]!, shown[1]!) : flipMap(shown[0]!, shown[1]!, exposure);
  const answer: Answer = {errors: errorsBetween(picture, reference, common), map: map as Float32Array<ArrayBuffer>, flip: meanOver(map, common)};
  self.postMessage(answer, {transfer: [answer.map.buffer]});
};
