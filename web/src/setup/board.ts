/** A printed chessboard: pictures of it in, the camera out, and the mount where one of them shows it on the floor. */
import { element } from '../app/dom.ts';
import type { Store } from '../app/state.ts';
import type { Board, BoardPicture, BoardResult, FittedMount, SourceFile } from '../model/protocol.ts';
import { boardFile, boardWords, floorWords } from './board-words.ts';

export interface BoardTools {
  look(board: Board, files: SourceFile[]): Promise<BoardResult>;
  mount(index: number, along: boolean): Promise<Pick<FittedMount, 'mount' | 'std'>>;
  /** Takes a rig or camera file as if it had been dropped. */
  use(file: SourceFile): Promise<void>;
}

export class BoardPanel {
  readonly #store: Store;
  readonly #tools: BoardTools;
  readonly #sizes: HTMLInputElement[];
  readonly #input = element('input', { type: 'file', multiple: true, hidden: true, accept: 'image/*,.pgm,.ppm,.pnm,.tif,.tiff', 'aria-label': 'Pictures of the board' });
  readonly #choose = element('button', { class: 'button', click: () => this.#input.click() }, 'Choose pictures of the board…');
  readonly #words = element('div', { role: 'status' });
  readonly #result = element('div', { class: 'board-result' });
  readonly #mountWords = element('p', { role: 'status' });
  #mount: Pick<FittedMount, 'mount' | 'std'> | null = null;
  /** Questions after the mount: the last one's answer counts. */
  #asked = 0;

  constructor(home: HTMLElement, store: Store, tools: BoardTools) {
    [this.#store, this.#tools] = [store, tools];
    const size = (label: string, value: string, most: string) => element('input', { type: 'number', min: '1', max: most, step: 'any', value, 'aria-label': label });
    this.#sizes = [size('Inner corners across', '9', '100'), size('Inner corners down', '6', '100'), size('Side of a square in mm', '25', '2000')];
    const [across, down, square] = this.#sizes as [HTMLInputElement, HTMLInputElement, HTMLInputElement];
    this.#input.addEventListener('change', () => {
      void this.#look([...(this.#input.files ?? [])]);
      this.#input.value = '';
    });
    home.addEventListener('dragover', (event) => event.preventDefault());
    home.addEventListener('drop', (event) => {
      const files = [...(event.dataTransfer?.files ?? [])];
      if (files.length === 0) return;
      event.preventDefault();
      // The page takes it for a sequence otherwise; what covers it while files are dragged is put away by a drop of nothing.
      event.stopPropagation();
      dispatchEvent(new DragEvent('drop'));
      void this.#look(files);
    });
    home.append(
      element('p', {}, 'Print a chessboard on something flat, and take ten or more pictures of it with the robot’s camera: sharp, tilted each time in another direction, in every part of the picture. One more with the board on the floor tells how the camera sits.'),
      element('div', { class: 'board-sizes' },
        element('span', {}, 'Inner corners'), element('span', { class: 'field' }, across, element('span', {}, '×'), down),
        element('span', {}, 'Square'), element('span', { class: 'field' }, square, element('span', {}, 'mm'))),
      element('div', { class: 'row' }, this.#choose, this.#input), this.#words, this.#result,
    );
  }

  async #look(files: File[]): Promise<void> {
    if (files.length === 0 || this.#choose.disabled) return;
    const [columns = 0, rows = 0, square = 0] = this.#sizes.map(({ value }) => Number(value));
    this.#choose.disabled = true;
    this.#result.replaceChildren();
    this.#words.replaceChildren(element('p', {}, `Looking for the board in ${files.length === 1 ? 'a picture' : `${files.length} pictures`}.`));
    try {
      const result = await this.#tools.look({ columns, rows, square: square / 1000 }, files.map((file) => ({ path: file.name, blob: file })));
      this.#show(result);
    } catch (error) {
      this.#words.replaceChildren(element('p', { class: 'problem' }, sentence(error)));
    } finally {
      this.#choose.disabled = false;
      this.#store.set({ busy: null });
    }
  }

  #show(result: BoardResult): void {
    this.#mount = null;
    [this.#mountWords.textContent, this.#mountWords.className] = ['', ''];
    const { camera, problem, warnings, pictures } = result;
    const told = camera ? [element('p', { class: 'fit-result' }, boardWords(camera, pictures))] : [element('p', { class: 'problem' }, problem)];
    this.#words.replaceChildren(...told, ...warnings.map((warning) => element('p', { class: 'problem' }, warning)));
    this.#result.replaceChildren(this.#table(pictures));
    if (camera) this.#result.append(...this.#floor(camera, pictures));
  }

  /** What each picture showed; one of them with its corners. */
  #table(pictures: BoardPicture[]): HTMLElement {
    const canvas = element('canvas', { role: 'img', width: '0', height: '0' });
    const buttons = pictures.map((picture) => {
      const show = () => {
        draw(canvas, picture);
        for (const other of buttons) other.setAttribute('aria-pressed', String(other === button));
      };
      const button: HTMLButtonElement = element('button', { class: 'tool', 'aria-pressed': 'false', click: show }, picture.name);
      button.disabled = picture.small === null;
      return button;
    });
    const rows = pictures.map(({ reason, rms, corners }, index) => element('tr', {},
      element('th', { scope: 'row' }, buttons[index]!),
      element('td', {}, reason ? `left out: it ${reason}` : rms > 0 ? `${corners.length / 2} corners, off by ${rms.toFixed(2)} px` : `${corners.length / 2} corners`)));
    buttons.find((button) => !button.disabled)?.click();
    return element('div', {}, canvas, element('div', { class: 'board-list', tabindex: '0', role: 'region', 'aria-label': 'Pictures of the board' },
      element('table', {}, element('caption', { class: 'visually-hidden' }, 'What each picture of the board showed'), element('tbody', {}, ...rows))));
  }

  #floor(camera: NonNullable<BoardResult['camera']>, pictures: BoardPicture[]): HTMLElement[] {
    const choices = pictures.map(({ name, reason }, index) => (reason ? [] : [element('option', { value: String(index) }, name)])).flat();
    const which = element('select', { 'aria-label': 'The picture in which the board lies on the floor' }, element('option', { value: '' }, 'none of them'), ...choices);
    const along = element('input', { type: 'checkbox' });
    const alongLabel = element('label', { class: 'board-along' }, along, 'A side of the board points straight ahead of the robot');
    alongLabel.hidden = true;
    const use = element('button', { class: 'button primary' }, 'Use it');
    const ask = async () => {
      const number = ++this.#asked;
      this.#mount = null;
      alongLabel.hidden = which.value === '';
      let words = '';
      use.disabled = true;
      try {
        const mount = which.value === '' ? null : await this.#tools.mount(Number(which.value), along.checked);
        if (number !== this.#asked) return;
        this.#mount = mount;
        if (mount) words = floorWords(mount, along.checked);
      } catch (error) {
        if (number !== this.#asked) return;
        words = sentence(error);
      }
      use.disabled = false;
      this.#mountWords.className = this.#mount ? 'fit-result' : words ? 'problem' : '';
      this.#mountWords.textContent = words;
    };
    which.addEventListener('change', () => void ask());
    along.addEventListener('change', () => void ask());
    use.addEventListener('click', () => void this.#tools.use(boardFile(this.#store.state.rig, camera, this.#mount)));
    return [
      element('label', { class: 'board-floor' }, element('span', {}, 'The board lies on the floor in'), which), alongLabel, this.#mountWords,
      element('div', { class: 'row' }, use),
    ];
  }
}

/** The picture with its corners, row by row as they were found. */
function draw(canvas: HTMLCanvasElement, { name, width, corners, small }: BoardPicture): void {
  if (!small) return;
  [canvas.width, canvas.height] = [small.width, small.height];
  canvas.setAttribute('aria-label', corners.length > 0 ? `${name} with the ${corners.length / 2} corners that were found` : `${name}, without corners`);
  const context = canvas.getContext('2d');
  if (!context) return;
  context.drawImage(small, 0, 0);
  const scale = small.width / width;
  const radius = Math.max(4, small.width / 120);
  for (const [colour, line] of [['#000000', 4], ['#e69f00', 2]] as const) {
    [context.strokeStyle, context.lineWidth] = [colour, (line * small.width) / 640];
    context.beginPath();
    for (let at = 0; at + 1 < corners.length; at += 2) {
      const [u, v] = [(corners[at]! + 0.5) * scale, (corners[at + 1]! + 0.5) * scale];
      context.moveTo(u + radius, v);
      context.arc(u, v, radius, 0, 2 * Math.PI);
    }
    context.stroke();
  }
}

function sentence(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
