import {expect, test} from 'vitest';
import {humanBytes, isPart, misplaced, namesIn, resolved, sceneChoices} from '../src/model/scene_files';

test('the highest file is the scene, and a mesh is one only if there is no other', () => {
  expect(sceneChoices(['s/assets/part.gltf', 's/room.json', 's/assets/box.obj'])).toEqual([['s/room.json'], ['s/assets/part.gltf']]);
  expect(sceneChoices(['b.obj', 'a.obj', 'a.mtl', 'c.ply'])).toEqual([['a.obj', 'b.obj']]);
  expect(sceneChoices(['b.STL', 'a.ply', 'a.png'])).toEqual([['a.ply'], ['b.STL']]);
  expect(sceneChoices(['s/room.pbrt', 's/geometry/walls.pbrt', 's/m.ply'])).toEqual([['s/room.pbrt'], ['s/geometry/walls.pbrt']]);
  expect(sceneChoices(['s/room.xml', 's/m.serialized'])).toEqual([['s/room.xml']]);
  expect(sceneChoices(['a.png'])).toEqual([]);
});

test('files that cannot belong to a scene are left out', () => {
  const paths = ['s/room.json', 's/.git/config.json', 's/notes.txt', 's/wood.JPG', 's/lamp.ies', 's/run.sh', '.DS_Store', 's/mesh.bin'];
  expect(paths.filter(isPart)).toEqual(['s/room.json', 's/wood.JPG', 's/lamp.ies', 's/mesh.bin']);
});

test('names are relative to the folder of their file, and never leave the dropped folder', () => {
  expect(resolved('s/scenes', '../assets/./box.obj')).toBe('s/assets/box.obj');
  expect(resolved('', 'a\\b.png')).toBe('a/b.png');
  expect(resolved('s', '../../b.png')).toBeUndefined();
});

test('references are found in each kind of file', () => {
  expect(namesIn('a.json', '{"objects": [{"mesh": {"file": "assets/b\\u0061x.obj"}}], "file":"x.png"}')).toEqual(['assets/bax.obj', 'assets/bax.obj', 'x.png', 'x.png']);
  expect(namesIn('a.gltf', '{"buffers": [{"uri": "my%20mesh.bin"}, {"uri": "data:application/octet-stream;base64,AA"}]}')).toEqual(['my%20mesh.bin', 'my mesh.bin']);
  expect(namesIn('a.obj', 'o x\nmtllib two words.mtl \r\nv 0 0 0\n')).toEqual(['two words.mtl']);
  expect(namesIn('a.mtl', 'newmtl m\n map_Kd -s 1 1 1 wood.png\nmap_Bump bump.png\r\nKd 1 1 1\n')).toEqual(['wood.png', 'bump.png']);
  expect(namesIn('a.pbrt', 'Include "geometry/a.pbrt"\nShape "plymesh" "string filename" [ "m.ply" ]\n"spectrum eta" "cu.spd" "float x" [1]')).toEqual(['geometry/a.pbrt', 'm.ply', 'cu.spd']);
  expect(namesIn('a.xml', '<include filename="parts/a.xml"/>\n<string name="filename" value="m.ply"/><string name=\'filename\' value=\'b.png\'/><string name="id" value="x"/>')).toEqual(['parts/a.xml', 'm.ply', 'b.png']);
  expect(namesIn('a.gltf', '{"uri": "%"}')).toEqual([]);
});

test('files chosen without their folders are matched by unique names', () => {
  const named = [{path: 'room.json', names: ['assets/Box.obj', 'assets/lamp.ies', 'there.obj']}];
  const found = misplaced(['room.json', 'box.obj', 'a/lamp.ies', 'b/lamp.ies', 'there.obj'], named);
  expect([...found]).toEqual([['assets/Box.obj', 'box.obj']]);
});

test('sizes have decimal units', () => {
  expect([0, 999, 1000, 1_500_000, 12_345_678, 2e12].map(humanBytes)).toEqual(['0 bytes', '999 bytes', '1.0 kB', '1.5 MB', '12 MB', '2.0 TB']);
});
