/** Results as files, by the command line's writers. */
import type { Rig } from 'monorange-wasm';
import type { Session, Source } from 'monorange-wasm-session';
import { rigToml } from '../model/rig-toml.ts';
import type { Work } from './work.ts';

/** What a report compares a run with, by the files' names. */
const BESIDE = [/(^|\/)(truth|ground_?truth|gt)\b[^/]*\.(tum|txt|csv)$|\.tum$/i, /(^|\/)laser[^/]*\.csv$/i, /(^|\/)landmarks[^/]*\.csv$/i];

/** Throws a sentence where something does not fit. */
export async function write(name: string, session: Session, rig: Rig, sources: Source[], work: Work): Promise<string | Blob> {
  const { Results, init, offer } = await import('monorange-wasm-results');
  await init();
  const writer = new Results('the page', rigToml(rig), session.record());
  try {
    if (name.startsWith('report.')) {
      const beside = await Promise.all(BESIDE.map(async (pattern) => {
        const file = sources.find(({ path }) => pattern.test(path));
        if (file) offer(file.path, new Uint8Array(await file.blob().arrayBuffer()));
        return file?.path;
      }));
      writer.compare(...(beside as [string | undefined, string | undefined, string | undefined]));
    }
    if (name.endsWith('.mcap')) {
      const frames = writer.beginMcap();
      const parts: Blob[] = [];
      const add = (bytes: Uint8Array) => bytes.length > 0 && parts.push(new Blob([bytes as Uint8Array<ArrayBuffer>]));
      for (const [done, frame] of frames.entries()) {
        add(writer.record(await session.grey(frame)));
        await work.pause(`Writing ${name}`, done / frames.length);
      }
      add(writer.endMcap());
      return new Blob(parts, { type: 'application/octet-stream' });
    }
    if (name === 'report.html') {
      for (const frame of writer.tellingFrames()) writer.addPicture(frame, await session.grey(frame));
    }
    return writer.write(name);
  } finally {
    writer.free();
  }
}
