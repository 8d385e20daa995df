// Results of robots in a results folder.
import {existsSync, readdirSync, readFileSync} from 'node:fs';
import {join} from 'node:path';

export const sum = (numbers) => numbers.reduce((a, b) => a + b, 0);

/** The summaries of the robots, by id. */
export function readSummaries(folder) {
  return readdirSync(folder)
      .map((name) => join(folder, name, 'summary.json'))
      .filter((file) => existsSync(file))
      .map((file) => JSON.parse(readFileSync(file)))
      .sort((a, b) => a.robot - b.robot);
}

/** A pair of keyframes "robot:index" as the page names it. */
const pairOf = (...ends) => ends.sort((a, b) => {
  const [[r0, k0], [r1, k1]] = [a, b].map((end) => end.split(':').map(Number));
  return r0 - r1 || k0 - k1;
}).join(' ');

/** The largest stage in any robot's loop_closures.csv, by pair of keyframes. */
export function readStages(folder, robots) {
  const stages = new Map();
  for (const {name} of robots) {
    const lines = readFileSync(join(folder, name, 'loop_closures.csv'), 'utf8').trim().split('\n');
    for (const line of lines.slice(1)) {
      const [r0, k0, r1, k1, , stage] = line.split(',');
      const pair = pairOf(`${r0}:${k0}`, `${r1}:${k1}`);
      if (stages.get(pair) !== 'inlier') stages.set(pair, stage);
    }
  }
  return stages;
}

/** Faces of all robots' meshes. */
export const facesOf = (robots) => sum(robots.map((robot) => robot.mapping?.faces ?? 0));

/** The numbers of objects in the robots' files. */
export const objectCounts = (folder, robots) =>
    robots.map(({name}) => join(folder, name, 'objects.json'))
        .filter(existsSync)
        .map((file) => JSON.parse(readFileSync(file)).objects.length);

/** Faces of the corrected meshes, by the heads of their files. */
export function facesOfMeshes(folder, robots) {
  const files = robots.map(({name}) => join(folder, name, 'mesh_optimized.ply')).filter(existsSync);
  return sum(files.map(
      (file) => Number(/element face (\d+)/.exec(readFileSync(file).toString('latin1', 0, 1000))[1])));
}
