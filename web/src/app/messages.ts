/** Sentences for the person: each names what it concerns and what to do, is read out, and can be put away. */
import { byId, element } from './dom.ts';

const MOST = 4;
/** Notes go by themselves after so long a time for each word, and not before the least. */
const NOTE_MS = { least: 8000, word: 450 };

/** A later sentence about the same thing takes the place of the one before. */
export function say(sentence: string, kind: 'problem' | 'note' = 'problem', about = sentence): void {
  const list = byId('messages');
  const before = [...list.children].find((shown) => (shown as HTMLElement).dataset['about'] === about);
  const text = before?.querySelector('span');
  if (text) {
    if (text.textContent !== sentence) text.textContent = sentence;
    return;
  }
  const close = element('button', { 'aria-label': 'Put this message away', click: () => message.remove() }, '✕');
  const message = element('div', { class: `message ${kind}`, 'data-about': about }, element('span', {}, sentence), close);
  list.append(message);
  while (list.childElementCount > MOST) list.firstElementChild?.remove();
  if (kind === 'note') setTimeout(() => message.remove(), Math.max(NOTE_MS.least, sentence.split(' ').length * NOTE_MS.word));
}

export function clearMessages(): void {
  byId('messages').replaceChildren();
}
