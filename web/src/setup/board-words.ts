/** What a board tells, in words and as a file. */
import type { BoardPicture, BoardResult, FittedMount, SourceFile } from '../model/protocol.ts';
import { DEGREE, type Rig } from '../model/rig.ts';
import { rigToml } from '../model/rig-toml.ts';

type Camera = NonNullable<BoardResult['camera']>;
type Told = Pick<FittedMount, 'mount' | 'std'>;

export function boardWords({ width, focal, std, rms }: Camera, pictures: BoardPicture[]): string {
  const used = pictures.filter(({ reason }) => !reason);
  const left = pictures.filter(({ reason }) => reason).map(({ name, reason }) => `${name} is left out: it ${reason}.`);
  const angle = (2 * Math.atan(width / 2 / focal[0])) / DEGREE;
  const words = `Focal length ${focal[0].toFixed(1)} ± ${(std[0] ?? 0).toFixed(1)} px, a view of ${angle.toFixed(1)}°; the corners of ${used.length} of ${pictures.length} pictures are off by ${rms.toFixed(2)} px rms.`;
  return [words, ...left].join(' ');
}

export function floorWords({ mount, std }: Told, along: boolean): string {
  const angle = (name: 'tilt' | 'roll' | 'yaw') => `${name} ${(mount[name] / DEGREE).toFixed(2)}° ± ${(std[name] / DEGREE).toFixed(2)}`;
  const angles = (along ? ['tilt', 'roll', 'yaw'] as const : ['tilt', 'roll'] as const).map(angle);
  return `Height ${mount.height.toFixed(3)} m ± ${std.height.toFixed(3)}, ${angles.join(', ')}.${along ? '' : ' The yaw stays as it is.'}`;
}

/** The rig with the camera, and with the mount where it is told; a camera file where it is not, beside which the mount stays what it was. */
export function boardFile(rig: Rig, camera: Camera, told: Told | null): SourceFile {
  const { width, height, focal, principal, distortion, pixelStd } = camera;
  if (!told) {
    const matrix = (name: string, rows: number, cols: number, data: number[]) => `${name}:\n  rows: ${rows}\n  cols: ${cols}\n  data: [${data.join(', ')}]\n`;
    const text = `image_width: ${width}\nimage_height: ${height}\ndistortion_model: plumb_bob\n`
      + matrix('camera_matrix', 3, 3, [focal[0], 0, principal[0], 0, focal[1], principal[1], 0, 0, 1])
      + matrix('distortion_coefficients', 1, distortion.length, distortion);
    return { path: 'board.yaml', blob: new Blob([text]) };
  }
  const { height: up, tilt, roll, yaw } = told.mount;
  const turned = told.std.yaw > 0;
  const calibrated: Rig = {
    ...rig, width, height, focal, principal, skew: 0, lens: 'polynomial', distortion, pixelStd, guessed: false, mountGuessed: false, assumedStd: {},
    mount: { ...rig.mount, height: up, tilt, roll, yaw: turned ? yaw : rig.mount.yaw },
    mountStd: { ...rig.mountStd, height: told.std.height, tilt: told.std.tilt, roll: told.std.roll, yaw: turned ? told.std.yaw : rig.mountStd.yaw },
  };
  return { path: 'board.toml', blob: new Blob([rigToml(calibrated)]) };
}
