// Measures the time from submission to the first pixels in a browser, on an idle farm with one worker of one thread:
//   node first_pixel.mjs FOLDER-OF-PROGRAMS [RUNS [SCENE [WIDTHxHEIGHT]]]
// The page posts the job, opens it, and checks its canvas before every frame.
import {helpOf} from './usage.mjs';

helpOf(`usage: node tests/bench/first_pixel.mjs FOLDER-OF-PROGRAMS [RUNS [SCENE [WIDTHxHEIGHT]]]

Prints the milliseconds from submission on the page to the first pixels, the median of RUNS (20).
FOLDER-OF-PROGRAMS: build/release/bin. SCENE: one of scenes/ without its ending (cornell-bench-blocks), of 512x512 pixels.`);
const {Session} = await import('../e2e/session.mjs'); // needs a browser

const [programs, runs = '20', scene = 'cornell-bench-blocks', size = '512x512'] = process.argv.slice(2);

/** In the browser: milliseconds until the picture's place shows something, and the job's number. */
async function submitAndLook({spec, run}) {
  const began = performance.now();
  const response = await fetch('/api/v1/jobs', {
    method: 'POST',
    headers: {'Content-Type': 'application/json'},
    body: JSON.stringify({request_id: crypto.randomUUID(), job: {...spec, name: `run ${run}`, settings: {...spec.settings, seed: String(1000 + run)}}}),
  });
  const {id, error} = await response.json();
  if (error) {
    throw new Error(error.message);
  }
  location.hash = `#/jobs/${id}`;
  const side = 128;
  const pixels = new Uint8Array(4 * side * side);
  while (performance.now() - began < 30_000) {
    await new Promise((resolve) => requestAnimationFrame(resolve));
    const canvas = document.querySelector('.viewer canvas');
    const gl = canvas?.getContext('webgl2');
    if (!gl || canvas.width < side || canvas.height < side) {
      continue;
    }
    gl.readPixels((canvas.width - side) >> 1, (canvas.height - side) >> 1, side, side, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const greens = pixels.filter((_, i) => i % 4 === 1);
    if (Math.max(...greens) - Math.min(...greens) > 40) {
      return {id, ms: performance.now() - began};
    }
  }
  throw new Error('no picture in 30 s');
}

const session = new Session(programs);
try {
  await session.start();
  const {farm} = session;
  const first = farm.submit(scene, '--size', size, '--spp', '16');
  await session.waitForState(first, 'DONE');
  const spec = await (await fetch(`${farm.page}api/v1/jobs/${first}/spec`)).json();
  const page = await session.open('#/jobs');
  const times = [];
  for (let run = 0; run < Number(runs); ++run) {
    await page.goto(`${farm.page}#/jobs`);
    await page.locator('.row-link').first().waitFor();
    const {id, ms} = await page.evaluate(submitAndLook, {spec, run});
    times.push(ms);
    await session.waitForState(id, 'DONE');
  }
  times.sort((a, b) => a - b);
  const middle = (times[(times.length - 1) >> 1] + times[times.length >> 1]) / 2;
  console.log(`${scene}, ${size}: first pixels after ${middle.toFixed(0)} ms, the median of ${times.length} runs (${times[0].toFixed(0)} to ${times.at(-1).toFixed(0)})`);
} finally {
  await session.close();
}
