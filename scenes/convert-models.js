// Called by get-models: node convert-models.js TEAPOT_PACKAGE BUNNY_PACKAGE ENVIRONMENT_MODULE FOLDER
//
// teapot.obj      6,320 triangles. The package has 992: a 4×4 grid of quads on each of Newell's 32 bicubic patches, less
//                 the ones without area. Five points in a row determine a cubic, so the script recovers the patches. It
//                 samples them by 10×10, which gives the usual number of triangles.
// bunny.obj       69,452 triangles. The package has 3,674. The script refines them twice by Loop's subdivision, and then
//                 halves the longest edges. (Stanford's original has 69,451. A closed mesh has an even number.)
// apartment.exr   the environment, 512×256, as it is in the package.
const fs = require("fs");
const path = require("path");

function fail(message) {
  console.error(`scenes/get-models: ${message}`);
  process.exit(1);
}

const combine = (weights, points) => [0, 1, 2].map((k) => weights.reduce((sum, w, i) => sum + w * points[i][k], 0));
const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

/** The 5×5 points of each of the teapot's patches, [i][j], from its list of triangles. */
function teapotPatches({ positions, cells }) {
  const patches = [];
  for (let next = 0; next < cells.length; ) {
    const patch = Array.from({ length: 5 }, () => Array(5));
    const put = (i, j, vertex) => {
      const point = positions[vertex];
      if (patch[i][j] && distance(patch[i][j], point) > 1e-5) {
        fail("the teapot's triangles are not in the order that is expected");
      }
      patch[i][j] = point;
    };
    const putQuad = (i, j, p00, p10, p11, p01) => {
      put(i, j, p00);
      put(i + 1, j, p10);
      put(i + 1, j + 1, p11);
      put(i, j + 1, p01);
    };
    for (let i = 0; i < 4; ++i) {
      for (let j = 0; j < 4; ++j) {
        // A quad is the triangles 00 10 11 and 11 01 00. Where its edge lies in a pole one of them is absent.
        const [a, b, c] = cells[next++];
        if (next < cells.length && cells[next][0] === c && cells[next][2] === a) {
          putQuad(i, j, a, b, c, cells[next++][1]);
        } else if (j === 0) {
          putQuad(i, j, c, c, a, b);
        } else {
          putQuad(i, j, a, b, c, c);
        }
      }
    }
    patches.push(patch);
  }
  return patches;
}

/** The cubic through points at 0, 1/4, 1/2, 3/4 and 1: the weights of the points at t. It passes all five only if they lie on one. */
function cubicWeights(t) {
  const knots = [0, 0.25, 0.75, 1];
  const w = knots.map((a) => knots.reduce((product, b) => (a === b ? product : (product * (t - b)) / (a - b)), 1));
  return [w[0], w[1], 0, w[2], w[3]];
}

function tessellateTeapot(mesh, n) {
  const patches = teapotPatches(mesh);
  const positions = [];
  const cells = [];
  const known = new Map();
  const vertex = (point) => {  // one for all points that are within rounding of each other
    const key = point.map((x) => Math.round(x * 2000)).join();
    if (!known.has(key)) {
      known.set(key, positions.length);
      positions.push(point);
    }
    return known.get(key);
  };
  const add = (a, b, c) => {
    if (a !== b && b !== c && c !== a) {
      cells.push([a, b, c]);
    }
  };
  for (const patch of patches) {
    const at = (u, v) => combine(cubicWeights(u), patch.map((row) => combine(cubicWeights(v), row)));
    for (let i = 0; i < 5; ++i) {
      for (let j = 0; j < 5; ++j) {
        if (distance(at(i / 4, j / 4), patch[i][j]) > 1e-4) {
          fail("the teapot's points do not lie on bicubic patches");
        }
      }
    }
    for (let i = 0; i < n; ++i) {
      for (let j = 0; j < n; ++j) {
        const corner = (di, dj) => vertex(at((i + di) / n, (j + dj) / n));
        const [p00, p10, p11, p01] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        add(p00, p10, p11);
        add(p11, p01, p00);
      }
    }
  }
  return { positions, cells };
}

/** Edges of a closed mesh: "a,b" with a < b to the two corners that are opposite. */
function edgesOf(cells) {
  const edges = new Map();
  for (const cell of cells) {
    for (let i = 0; i < 3; ++i) {
      const [a, b, opposite] = [cell[i], cell[(i + 1) % 3], cell[(i + 2) % 3]];
      const key = a < b ? `${a},${b}` : `${b},${a}`;
      if (!edges.has(key)) {
        edges.set(key, { ends: [a, b], opposite: [] });
      }
      edges.get(key).opposite.push(opposite);
    }
  }
  for (const { opposite } of edges.values()) {
    if (opposite.length !== 2) {
      fail("the bunny's mesh is not closed");
    }
  }
  return edges;
}

const keyOf = (a, b) => (a < b ? `${a},${b}` : `${b},${a}`);

/** One step of Loop's subdivision (Loop 1987, with Warren's weights) of a closed mesh. */
function loopSubdivision({ positions, cells }) {
  const edges = edgesOf(cells);
  const neighbours = positions.map(() => []);
  const result = { positions: [], cells: [] };
  const middle = new Map();
  for (const [key, { ends }] of edges) {
    neighbours[ends[0]].push(ends[1]);
    neighbours[ends[1]].push(ends[0]);
    middle.set(key, positions.length + middle.size);
  }
  for (const [v, around] of neighbours.entries()) {
    const n = around.length;
    const beta = n > 3 ? 3 / (8 * n) : 3 / 16;
    result.positions.push(combine([1 - n * beta, ...around.map(() => beta)], [v, ...around].map((i) => positions[i])));
  }
  for (const { ends, opposite } of edges.values()) {
    result.positions.push(combine([3 / 8, 3 / 8, 1 / 8, 1 / 8], [...ends, ...opposite].map((i) => positions[i])));
  }
  for (const [a, b, c] of cells) {
    const [ab, bc, ca] = [middle.get(keyOf(a, b)), middle.get(keyOf(b, c)), middle.get(keyOf(c, a))];
    result.cells.push([a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]);
  }
  return result;
}

/** Halves `count` of the longest edges, at most one of each triangle. Each halved edge adds two triangles. */
function halveLongest({ positions, cells }, count) {
  const edges = [...edgesOf(cells).entries()];
  const length = ([, { ends }]) => distance(positions[ends[0]], positions[ends[1]]);
  edges.sort((a, b) => length(b) - length(a));
  const taken = new Set();  // triangles that have an edge to be halved, by their edge and opposite corner
  const halved = new Map();
  const result = { positions: [...positions], cells: [] };
  const triangleKey = (a, b, c) => [a, b, c].sort((x, y) => x - y).join();
  for (const [key, { ends, opposite }] of edges) {
    const triangles = opposite.map((o) => triangleKey(...ends, o));
    if (halved.size < count && !triangles.some((t) => taken.has(t))) {
      triangles.forEach((t) => taken.add(t));
      halved.set(key, result.positions.length);
      result.positions.push(combine([0.5, 0.5], ends.map((i) => positions[i])));
    }
  }
  for (const cell of cells) {
    const i = [0, 1, 2].findIndex((k) => halved.has(keyOf(cell[k], cell[(k + 1) % 3])));
    if (i < 0) {
      result.cells.push(cell);
    } else {
      const [a, b, c] = [cell[i], cell[(i + 1) % 3], cell[(i + 2) % 3]];
      const m = halved.get(keyOf(a, b));
      result.cells.push([a, m, c], [m, b, c]);
    }
  }
  return result;
}

function write(folder, name, mesh, triangles) {
  if (mesh.cells.length !== triangles) {
    fail(`${name} has ${mesh.cells.length} triangles, ${triangles} were expected`);
  }
  const lines = mesh.positions.map((p) => "v " + p.map((x) => +x.toFixed(6)).join(" "));
  lines.push("s 1", ...mesh.cells.map((cell) => "f " + cell.map((i) => i + 1).join(" ")));
  put(folder, name, lines.join("\n") + "\n", `${triangles} triangles`);
}

function put(folder, name, content, what) {
  const file = path.join(folder, name);
  fs.writeFileSync(file + ".part", content);
  fs.renameSync(file + ".part", file);
  console.log(`wrote scenes/models/${name}, ${what}`);
}

const [teapotPackage, bunnyPackage, environmentModule, folder] = process.argv.slice(2).map((p) => path.resolve(p));
write(folder, "teapot.obj", tessellateTeapot(require(teapotPackage), 10), 6320);
const bunny = loopSubdivision(loopSubdivision(require(bunnyPackage)));
write(folder, "bunny.obj", halveLongest(bunny, (69452 - bunny.cells.length) / 2), 69452);
const data = fs.readFileSync(environmentModule, "latin1").match(/base64,([A-Za-z0-9+/=]+)/);
if (!data) {
  fail(`${environmentModule} holds no image`);
}
put(folder, "apartment.exr", Buffer.from(data[1], "base64"), "an environment of 512×256 pixels");
