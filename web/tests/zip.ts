/** ZIP archives, as packers write them, and as they should not. */
import { crc32, deflateRawSync } from 'node:zlib';

export interface Entry {
  path: string;
  content: Buffer | string;
  /** Says that it needs a password. */
  encrypted?: boolean;
  /** Says that it has so many bytes. */
  claims?: number;
}

/** Every second file is stored as it is, the others are deflated. */
export function zip(entries: Entry[]): Buffer {
  const [files, list]: [Buffer[], Buffer[]] = [[], []];
  let at = 0;
  entries.forEach(({ path, content, encrypted, claims }, index) => {
    const [name, data] = [Buffer.from(path), Buffer.from(content)];
    const packed = index % 2 === 0 ? deflateRawSync(data) : data;
    const common = Buffer.alloc(26);
    common.writeUInt16LE(20, 0);
    common.writeUInt16LE((encrypted ? 1 : 0) | 0x800, 2);
    common.writeUInt16LE(index % 2 === 0 ? 8 : 0, 4);
    common.writeUInt32LE(crc32(data), 10);
    common.writeUInt32LE(packed.length, 14);
    common.writeUInt32LE(claims ?? data.length, 18);
    common.writeUInt16LE(name.length, 22);
    const here = Buffer.concat([Buffer.from('PK\x03\x04', 'latin1'), common, name, packed]);
    const rest = Buffer.alloc(14);
    rest.writeUInt32LE(at, 10);
    list.push(Buffer.concat([Buffer.from('PK\x01\x02\x14\0', 'latin1'), common, rest, name]));
    files.push(here);
    at += here.length;
  });
  const end = Buffer.alloc(22);
  end.write('PK\x05\x06', 'latin1');
  end.writeUInt16LE(entries.length, 8);
  end.writeUInt16LE(entries.length, 10);
  end.writeUInt32LE(list.reduce((sum, { length }) => sum + length, 0), 12);
  end.writeUInt32LE(at, 16);
  return Buffer.concat([...files, ...list, end]);
}
