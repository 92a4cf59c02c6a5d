/** Results as files, by the command line's writers. */
import { loadFiles } from './files.ts';
import type { FrameResult } from './protocol.ts';

/** A run's results, as the writers need them. */
export interface Written {
  results: FrameResult[];
  /** Rows id, x, y, var_x, cov_xy, var_y, seen, first time, last time. */
  map: Float64Array;
}

/** Throws a sentence for a file that nobody can write. */
export async function write(name: string, { results, map }: Written): Promise<string> {
  const { Results } = await loadFiles();
  const writer = new Results();
  try {
    for (const { t, pose, covariance, problem } of results) if (!problem) writer.addPose(t, pose, covariance);
    writer.setMap(map);
    const writers: Record<string, () => string> = {
      'trajectory.tum': () => writer.tum(),
      'trajectory.csv': () => writer.csv(),
      'map.csv': () => writer.map(),
      'map.ply': () => writer.ply(),
    };
    const chosen = writers[name];
    if (!chosen) throw new Error(`There is no writer for ${name}.`);
    return chosen();
  } finally {
    writer.free();
  }
}
