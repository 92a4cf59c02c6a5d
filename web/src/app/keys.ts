/** Keys that work anywhere but in a field: space plays, arrows step, the rest is on the buttons' hints. */
import type { Player } from '../timeline/player.ts';
import type { Store } from './state.ts';

export function mountKeys(store: Store, player: Player, fit: () => void): void {
  const actions: Record<string, () => void> = {
    ' ': () => player.toggle(),
    ArrowLeft: () => player.step(-1),
    ArrowRight: () => player.step(1),
    PageUp: () => player.step(-10),
    PageDown: () => player.step(10),
    Home: () => player.show(0),
    End: () => player.show(Infinity),
    '0': fit,
    Escape: () => store.set({ tape: [], selected: null, pickingPoints: false }),
  };
  addEventListener('keydown', (event) => {
    const target = event.target as HTMLElement;
    const typing = /^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName);
    const pressing = target.tagName === 'BUTTON' && event.key === ' ';
    if (typing || pressing || event.ctrlKey || event.metaKey || event.altKey) return;
    const action = actions[event.key];
    if (!action) return;
    action();
    if (event.key !== 'Escape') event.preventDefault();
  });
}
