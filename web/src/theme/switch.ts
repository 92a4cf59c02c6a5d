/** The button that goes round system, light, dark; the choice is kept on this machine. */
import { byId } from '../app/dom.ts';
import { setTheme, type Theme } from './palette.ts';

const KEY = 'monorange-theme';
const NEXT: Record<Theme, Theme> = { system: 'light', light: 'dark', dark: 'system' };
const WORDS: Record<Theme, string> = { system: 'as the system', light: 'light', dark: 'dark' };

export function mountTheme(): void {
  const button = byId('theme');
  let theme: Theme = kept();
  const apply = () => {
    setTheme(theme);
    button.title = `Theme: ${WORDS[theme]}`;
    button.setAttribute('aria-label', button.title);
  };
  button.addEventListener('click', () => {
    theme = NEXT[theme];
    try {
      localStorage.setItem(KEY, theme);
    } catch {
      // Private windows may forbid it; the theme then lasts as long as the page.
    }
    apply();
  });
  apply();
}

function kept(): Theme {
  try {
    const theme = localStorage.getItem(KEY);
    return theme === 'light' || theme === 'dark' ? theme : 'system';
  } catch {
    return 'system';
  }
}
