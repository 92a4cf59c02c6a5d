/** The layers of both views: the legend is the switch. */
import { byId, element } from '../app/dom.ts';
import type { Store } from '../app/state.ts';

type Glyph = 'dot' | 'ring' | 'ellipse' | 'line' | 'dashed' | 'grid' | 'picture' | 'text' | 'path' | 'wedge' | 'dots';

interface Layer {
  name: string;
  label: string;
  glyph: Glyph;
  /** A CSS variable's name. */
  colour: string;
  hint: string;
  off?: true;
}

const CAMERA: Layer[] = [
  { name: 'picture', label: 'Picture', glyph: 'picture', colour: 'quiet', hint: 'The camera’s picture' },
  { name: 'corners', label: 'Seen', glyph: 'dot', colour: 'seen', hint: 'Floor corners that were seen' },
  { name: 'ranges', label: 'Ranges', glyph: 'text', colour: 'text', hint: 'Number, range and ±σ of each corner: the pixel’s noise and the mount’s error together' },
  { name: 'predicted', label: 'Predicted', glyph: 'ellipse', colour: 'predicted', hint: 'Where the map expects its landmarks: 2σ' },
  { name: 'refused', label: 'Refused', glyph: 'ring', colour: 'refused', hint: 'Corners that were refused; point at one for the reason' },
  { name: 'edges', label: 'Edges', glyph: 'dots', colour: 'predicted', hint: 'Edge points: what lines are looked for in', off: true },
  { name: 'lines', label: 'Lines', glyph: 'line', colour: 'seen', hint: 'Straight lines found' },
  { name: 'scan', label: 'Free floor', glyph: 'wedge', colour: 'mapped', hint: 'The virtual scan: how far the floor is seen free; yellow with ±σ is what bounds it, a diamond what stands by itself' },
  { name: 'horizon', label: 'Horizon', glyph: 'dashed', colour: 'text', hint: 'The horizon' },
  { name: 'grid', label: 'Grid', glyph: 'grid', colour: 'quiet', hint: 'Floor grid, its spacing by how far the picture sees; bold every fifth line' },
];

const MAP: Layer[] = [
  { name: 'path', label: 'Path', glyph: 'path', colour: 'seen', hint: 'Where the robot was' },
  { name: 'landmarks', label: 'Map', glyph: 'ellipse', colour: 'mapped', hint: 'Landmarks with their 3σ ellipses' },
  { name: 'footprint', label: 'View', glyph: 'wedge', colour: 'predicted', hint: 'The floor that the picture shows' },
  { name: 'fan', label: 'Free floor', glyph: 'wedge', colour: 'mapped', hint: 'How far the floor is seen free from where the robot is' },
  { name: 'truth', label: 'Truth', glyph: 'dashed', colour: 'text', hint: 'The true path' },
  { name: 'laser', label: 'Laser', glyph: 'dots', colour: 'quiet', hint: 'What a laser saw' },
];

/** Which layers are on before anyone has touched a switch. */
export function defaultLayers(): Record<string, boolean> {
  return Object.fromEntries([...CAMERA, ...MAP].map(({ name, off }) => [name, !off]));
}

export function mountLayers(store: Store, changed: () => void): void {
  for (const [id, layers] of [['layers', CAMERA], ['map-layers', MAP]] as const) {
    const chips = layers.map((layer) => {
      const chip = element('button', { class: 'chip', title: layer.hint, 'data-layer': layer.name }, glyph(layer), layer.label);
      chip.addEventListener('click', () => {
        const now = store.state.layers;
        store.set({ layers: { ...now, [layer.name]: !now[layer.name] } });
        changed();
      });
      return chip;
    });
    byId(id).replaceChildren(...chips);
    store.on(['layers', 'sequence'], ({ layers: on, sequence }) => {
      for (const chip of chips) {
        const name = chip.dataset['layer'] ?? '';
        chip.setAttribute('aria-pressed', String(on[name] ?? false));
        if (name === 'truth') chip.hidden = !sequence?.truth;
        if (name === 'laser') chip.hidden = !sequence?.laser;
      }
    });
  }
}

const SHAPES: Record<Glyph, string> = {
  dot: '<circle cx="9" cy="7" r="4" data-solid="1"/>',
  ring: '<circle cx="9" cy="7" r="3.7"/><path d="M6.4 9.6l5.2-5.2"/>',
  ellipse: '<ellipse cx="9" cy="7" rx="7" ry="4.2" transform="rotate(-18 9 7)"/>',
  line: '<path d="M1 11 17 3"/>',
  dashed: '<path d="M0 7h18" stroke-dasharray="4 3"/>',
  grid: '<path d="M1 12h16M3.5 7h11M5.5 3h7M9 3v9M5.5 3 1 12M12.5 3 17 12"/>',
  picture: '<rect x="2" y="1.5" width="14" height="11" rx="1.5"/><path d="m3 11 4-4 3 3 2.5-2.5L16 10"/>',
  text: '<path d="M2 4h14M2 7h9M2 10h12"/>',
  path: '<path d="M1 11C5 2 9 13 17 3"/>',
  wedge: '<path d="M2 7 16 1v12z"/>',
  dots: '<circle cx="4" cy="9" r="1.3" data-solid="1"/><circle cx="9" cy="5" r="1.3" data-solid="1"/><circle cx="14" cy="8" r="1.3" data-solid="1"/>',
};

function glyph(layer: Layer): Element {
  const svg = new DOMParser().parseFromString(
    `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 18 14" aria-hidden="true">${SHAPES[layer.glyph]}</svg>`,
    'image/svg+xml',
  ).documentElement as unknown as SVGSVGElement;
  svg.style.stroke = `var(--${layer.colour})`;
  for (const solid of svg.querySelectorAll<SVGElement>('[data-solid]')) solid.style.fill = `var(--${layer.colour})`;
  return document.importNode(svg, true);
}
