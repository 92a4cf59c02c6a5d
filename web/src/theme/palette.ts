/** The theme, and its colours for canvases, which cannot read CSS variables. */
const NAMES = ['ground', 'panel', 'raised', 'line', 'text', 'quiet', 'accent', 'seen', 'predicted', 'mapped', 'refused', 'bound'] as const;

export type Palette = Record<(typeof NAMES)[number], string>;

export type Theme = 'system' | 'light' | 'dark';

let known: Palette | null = null;
const listeners: (() => void)[] = [];

export function palette(): Palette {
  return (known ??= read());
}

/** Calls `listener` whenever the colours have changed. */
export function onThemeChange(listener: () => void): void {
  listeners.push(listener);
}

export function setTheme(theme: Theme): void {
  if (theme === 'system') delete document.documentElement.dataset['theme'];
  else document.documentElement.dataset['theme'] = theme;
  changed();
}

matchMedia('(prefers-color-scheme: dark)').addEventListener('change', changed);

function changed(): void {
  known = null;
  for (const listener of listeners) listener();
}

function read(): Palette {
  // light-dark() is resolved only in a property that is a colour.
  const probe = document.createElement('i');
  document.body.append(probe);
  const colour = (name: string) => {
    probe.style.color = `var(--${name})`;
    return getComputedStyle(probe).color;
  };
  const colours = Object.fromEntries(NAMES.map((name) => [name, colour(name)])) as Palette;
  probe.remove();
  return colours;
}
