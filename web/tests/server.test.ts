/** The server of `cargo xtask demo` (the same `vite preview`): this machine alone, and no way out of its folder. */
import { mkdir, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { get } from 'node:http';
import { type AddressInfo } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { expect, test } from 'vitest';
import { preview } from 'vite';
import { HEADERS } from '../vite.config.ts';

test('only files of its own folder are served, and only to this machine', async () => {
  const root = await mkdtemp(join(tmpdir(), 'monorange-server-'));
  await mkdir(join(root, 'dist'));
  await writeFile(join(root, 'dist', 'index.html'), 'the page');
  await writeFile(join(root, 'secret.txt'), 'a secret');
  const server = await preview({ root, configFile: false, logLevel: 'error', preview: { host: '127.0.0.1', port: 0, headers: HEADERS } });
  try {
    const { address, port } = server.httpServer.address() as AddressInfo;
    expect(address).toBe('127.0.0.1');
    // By hand: a browser would tidy these paths up before it asks.
    const ask = (path: string) => new Promise<string>((done, fail) => {
      get({ host: '127.0.0.1', port, path }, (response) => {
        let text = '';
        response.setEncoding('utf8').on('data', (part: string) => (text += part)).on('end', () => done(text));
      }).on('error', fail);
    });
    expect(await ask('/')).toContain('the page');
    const { headers } = await fetch(`http://127.0.0.1:${port}/`);
    expect([headers.get('x-content-type-options'), headers.get('content-security-policy')]).toEqual(['nosniff', "frame-ancestors 'none'"]);
    for (const path of ['/../secret.txt', '/..%2fsecret.txt', '/%2e%2e/secret.txt', '/x/../../secret.txt', '/..\\secret.txt', '//secret.txt']) {
      expect(await ask(path), path).not.toContain('a secret');
    }
  } finally {
    await server.close();
    await rm(root, { recursive: true, force: true });
  }
});
