/** The results.json of a lab (docs/guide/lab.md) as charts: errors against time of several methods on several scenes. */
import {kLineColors, type ChartLine} from './chart';
import type {CurvePoint} from './error_curve';

export interface LabScene {
  name: string;
  reference: string;
  /** One line per method. A point's interval is from its best to its worst seed. */
  lines: ChartLine[];
}

export interface LabReport {
  title: string;
  scenes: LabScene[];
}

type Fields = Record<string, unknown>;

function fields(value: unknown, what: string): Fields {
  if (typeof value !== 'object' || value === null || Array.isArray(value)) {
    throw new Error(`${what} is not an object: this is not the results.json that "lightmill lab" writes`);
  }
  return value as Fields;
}

function list(of: Fields, name: string, what: string): unknown[] {
  const value = of[name];
  if (!Array.isArray(value)) {
    throw new Error(`${what} has no list "${name}": this is not the results.json that "lightmill lab" writes`);
  }
  return value;
}

function text(value: unknown): string {
  return typeof value === 'string' ? value : '';
}

/** Undefined for what logarithmic axes cannot show. */
function pointOf(value: unknown): CurvePoint | undefined {
  const of = fields(value, 'a point');
  const number = (name: string) => (typeof of[name] === 'number' ? of[name] : NaN);
  const [seconds, error] = [number('thread_seconds'), number('rel_mse')];
  const [least, most] = [number('rel_mse_least'), number('rel_mse_most')];
  return seconds > 0 && error > 0 ? {seconds, error, low: least > 0 ? least : error, high: most > 0 ? most : error} : undefined;
}

/** Throws an Error that says what is wrong. */
export function parseLabReport(json: string): LabReport {
  let whole: Fields;
  try {
    whole = fields(JSON.parse(json), 'the file');
  } catch (error) {
    throw error instanceof SyntaxError ? new Error(`the file is not JSON: ${error.message}`) : error;
  }
  const scenes = list(whole, 'scenes', 'the file').map((each) => {
    const scene = fields(each, 'a scene');
    const name = text(scene.scene);
    const lines = list(scene, 'methods', `scene ${name}`).map((every, i) => {
      const method = fields(every, 'a method');
      const points = list(method, 'curve', `a method of scene ${name}`).map(pointOf);
      return {
        name,
        method: text(method.method),
        color: kLineColors[i % kLineColors.length]!,
        points: points.filter((point) => point !== undefined),
      };
    });
    return {name, reference: text(scene.reference), lines};
  });
  return {title: text(whole.title), scenes};
}
