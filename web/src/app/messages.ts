/** Sentences for the person: each names what it concerns and what to do, is read out, and can be put away. */
import { byId, element } from './dom.ts';

const MOST = 4;

export function say(sentence: string, kind: 'problem' | 'note' = 'problem'): void {
  const list = byId('messages');
  if ([...list.children].some((shown) => shown.querySelector('span')?.textContent === sentence)) return;
  const close = element('button', { 'aria-label': 'Put this message away', click: () => message.remove() }, '✕');
  const message = element('div', { class: `message ${kind}` }, element('span', {}, sentence), close);
  list.append(message);
  while (list.childElementCount > MOST) list.firstElementChild?.remove();
  if (kind === 'note') setTimeout(() => message.remove(), 8000);
}

export function clearMessages(): void {
  byId('messages').replaceChildren();
}
