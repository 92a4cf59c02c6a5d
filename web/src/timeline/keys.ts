/** Keys of the views: space plays, arrows step. Elsewhere keys do what they do on any page, such as scroll it. */
import type { Player } from './player.ts';
import type { Store } from '../app/state.ts';

export function mountKeys(store: Store, player: Player, fit: () => void, undo: () => void): void {
  const actions: Record<string, () => void> = {
    ' ': () => player.toggle(),
    ArrowLeft: () => player.step(-1),
    ArrowRight: () => player.step(1),
    PageUp: () => player.step(-10),
    PageDown: () => player.step(10),
    Home: () => player.show(0),
    End: () => player.show(Infinity),
    '0': fit,
  };
  addEventListener('keydown', (event) => {
    const target = event.target as HTMLElement;
    if (/^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName)) return;
    if ((event.ctrlKey || event.metaKey) && event.key === 'z') {
      event.preventDefault();
      return undo();
    }
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === 'Escape') return store.set({ tape: [], selected: null, pickingPoints: false });
    if (target.tagName === 'BUTTON' && event.key === ' ') return;
    // A letter or digit without a modifier counts in the view that it is for, and nowhere else.
    const inView = target.closest('.camera .view, .transport') !== null;
    const scrolls = document.documentElement.scrollHeight > innerHeight + 1;
    const action = actions[event.key];
    if (!action || !(inView || (target === document.body && !scrolls && event.key !== '0'))) return;
    action();
    event.preventDefault();
  });
}
