/** Debian's Firefox by WebDriver BiDi: as much of it as the tests need, since its commands are fewer than a library's. */
import { spawn, type ChildProcess } from 'node:child_process';
import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { WebSocket } from 'ws';

interface Answer {
  id?: number;
  result?: Record<string, unknown>;
  error?: string;
  message?: string;
}

export class Firefox {
  readonly #process: ChildProcess;
  readonly #socket: WebSocket;
  readonly #profile: string;
  readonly #waiting = new Map<number, (answer: Answer) => void>();
  #next = 0;
  #context = '';

  private constructor(child: ChildProcess, socket: WebSocket, profile: string) {
    [this.#process, this.#socket, this.#profile] = [child, socket, profile];
    socket.addEventListener('message', ({ data }) => {
      const answer = JSON.parse(String(data)) as Answer;
      if (answer.id === undefined) return;
      this.#waiting.get(answer.id)?.(answer);
      this.#waiting.delete(answer.id);
    });
  }

  static async start(path: string): Promise<Firefox> {
    const profile = await mkdtemp(join(tmpdir(), 'monorange-firefox-'));
    const child = spawn(path, ['--headless', '--no-remote', '--profile', profile, '--remote-debugging-port', '0', 'about:blank'], { stdio: ['ignore', 'ignore', 'pipe'] });
    const address = await new Promise<string>((done, fail) => {
      let said = '';
      child.stderr!.on('data', (part: Buffer) => {
        said += part.toString();
        const found = /WebDriver BiDi listening on (ws:\/\/\S+)/.exec(said);
        if (found) done(found[1]!);
      });
      child.on('exit', () => fail(new Error(`Firefox has ended: ${said}`)));
    });
    const socket = new WebSocket(`${address}/session`);
    await new Promise((done, fail) => {
      socket.addEventListener('open', done);
      socket.addEventListener('error', () => fail(new Error(`Firefox does not answer at ${address}.`)));
    });
    const firefox = new Firefox(child, socket, profile);
    await firefox.send('session.new', { capabilities: {} });
    return firefox;
  }

  async send(method: string, params: object): Promise<Record<string, unknown>> {
    const id = this.#next++;
    const answer = await new Promise<Answer>((done) => {
      this.#waiting.set(id, done);
      this.#socket.send(JSON.stringify({ id, method, params }));
    });
    if (answer.error) throw new Error(`${method}: ${answer.error}: ${answer.message ?? ''}`);
    return answer.result ?? {};
  }

  /** Opens an address in a tab of its own. */
  async open(url: string): Promise<void> {
    if (this.#context) await this.send('browsingContext.close', { context: this.#context });
    const { context } = await this.send('browsingContext.create', { type: 'tab' });
    this.#context = String(context);
    await this.send('browsingContext.setViewport', { context, viewport: { width: 1280, height: 800 } });
    await this.send('browsingContext.navigate', { context, url, wait: 'complete' });
  }

  /** The value of an expression, which must be one that JSON can say; a promise is waited for. */
  async evaluate<T>(expression: string): Promise<T> {
    const answer = await this.send('script.evaluate', {
      expression: `(async () => JSON.stringify(await (${expression})))()`, target: { context: this.#context }, awaitPromise: true,
    }) as { type: string; result?: { value?: string }; exceptionDetails?: { text: string } };
    if (answer.type === 'exception') throw new Error(answer.exceptionDetails?.text);
    return JSON.parse(answer.result?.value ?? 'null') as T;
  }

  /** Presses the mouse at these points, one after another. */
  async click(points: [number, number][]): Promise<void> {
    const actions = points.flatMap(([x, y]) => [
      { type: 'pointerMove', x: Math.round(x), y: Math.round(y) }, { type: 'pointerDown', button: 0 }, { type: 'pointerUp', button: 0 }, { type: 'pause', duration: 100 },
    ]);
    await this.send('input.performActions', { context: this.#context, actions: [{ type: 'pointer', id: 'mouse', parameters: { pointerType: 'mouse' }, actions }] });
  }

  async close(): Promise<void> {
    this.#socket.close();
    const ended = new Promise((done) => this.#process.on('exit', done));
    this.#process.kill();
    await ended;
    await rm(this.#profile, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 });
  }
}
