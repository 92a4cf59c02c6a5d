/** The export menu: what there is to save now, and under which name. */
import { byId, element } from '../app/dom.ts';
import { say } from '../app/messages.ts';
import type { Store } from '../app/state.ts';
import type { Engine } from '../engine/client.ts';
import { rigToml } from '../model/rig-toml.ts';
import type { Canvas } from '../views/canvas.ts';
import { save } from '../app/save.ts';

const RESULTS = [
  ['report.html', 'everything on one page'],
  ['trajectory.tum', 'poses, TUM'],
  ['trajectory.csv', 'poses with covariances'],
  ['map.csv', 'landmarks with covariances'],
  ['map.ply', 'landmarks, point cloud'],
  ['observations.csv', 'one row a corner'],
  ['report.json', 'figures and settings'],
  ['drive.mcap', 'for Foxglove, rerun and ROS 2'],
] as const;

export function mountExport(store: Store, engine: Engine, views: Record<'camera.png' | 'map.png', Canvas>): void {
  const menu = byId('export-menu');
  const entry = (name: string, hint: string, write: () => Promise<void>) => {
    const button = element('button', {}, name, element('small', {}, hint));
    button.addEventListener('click', () => {
      menu.hidePopover();
      write().catch((error: unknown) => say(`${name} was not saved: ${error instanceof Error ? error.message : String(error)}`));
    });
    return button;
  };
  const results = RESULTS.map(([name, hint]) => entry(name, hint, async () => {
    try {
      save(name, await engine.call('write', { name }));
    } finally {
      store.set({ busy: null });
    }
  }));
  menu.replaceChildren(
    element('h2', {}, 'Results'), ...results,
    element('h2', {}, 'Pictures'),
    entry('camera.png', 'the camera view as shown', async () => save('camera.png', await views['camera.png'].png())),
    entry('map.png', 'the map as shown', async () => save('map.png', await views['map.png'].png())),
    element('h2', {}, 'Settings'),
    entry('rig.toml', 'camera and mount', async () => save('rig.toml', rigToml(store.state.rig))),
  );
  store.on(['results', 'sequence'], ({ results: done, sequence }) => {
    for (const button of results) button.disabled = done.length === 0 || !sequence;
  });
}
