/** What a dropped file is for, by its name: pictures in natural order, and the text files beside them. */
export type Kind = 'picture' | 'video' | 'rig' | 'camera' | 'odometry' | 'times' | 'truth' | 'laser' | 'landmarks' | 'other';

const PICTURE = /\.(png|jpe?g|webp|bmp|gif|avif|pgm|ppm|pnm|pbm|tiff?)$/i;
const VIDEO = /\.(mp4|m4v|webm|mov|mkv|ogv|avi)$/i;

/** Files that systems leave in folders, which nobody means to open. */
const LITTER = /(^|\/)(\.|__MACOSX\/|Thumbs\.db$|desktop\.ini$)/i;

export function kindOf(path: string): Kind {
  const name = path.slice(path.lastIndexOf('/') + 1).toLowerCase();
  if (PICTURE.test(name)) return 'picture';
  if (VIDEO.test(name)) return 'video';
  if (name.endsWith('.toml')) return 'rig';
  if (/\.(ya?ml|xml)$/.test(name)) return 'camera';
  if (/^(truth|ground_?truth|gt)\b.*\.(tum|txt|csv)$/.test(name) || name.endsWith('.tum')) return 'truth';
  if (/^(times?|timestamps?)\b.*\.(txt|csv)$/.test(name)) return 'times';
  if (/^odo.*\.(csv|txt)$/.test(name)) return 'odometry';
  if (/^laser.*\.csv$/.test(name)) return 'laser';
  if (/^landmarks.*\.csv$/.test(name)) return 'landmarks';
  return 'other';
}

/** Whether the file is one that nobody meant to open. */
export function isLitter(path: string): boolean {
  return LITTER.test(path);
}

/** The folder that holds most of these pictures, and the pictures in it: a drop may carry others beside. */
export function mainFolder(paths: string[]): string[] {
  const folders = new Map<string, string[]>();
  for (const path of paths) {
    const folder = path.slice(0, path.lastIndexOf('/') + 1);
    folders.set(folder, [...(folders.get(folder) ?? []), path]);
  }
  return [...folders.values()].sort((a, b) => b.length - a.length)[0] ?? [];
}
