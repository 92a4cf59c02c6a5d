import { expect, test } from 'vitest';
import { isLitter, kindOf, mainFolder } from './kinds.ts';

test('files are told apart by their names', () => {
  const kinds = {
    'a/frames/000001.png': 'picture', 'IMG_2.JPEG': 'picture', 'scan.pgm': 'picture', 'drive.mp4': 'video', 'rig.toml': 'rig',
    'camera.yaml': 'camera', 'left_intrinsics.yml': 'camera', 'odometry.csv': 'odometry', 'times.txt': 'times', 'truth.tum': 'truth',
    'groundtruth.txt': 'truth', 'laser.csv': 'laser', 'notes.txt': 'other', 'landmarks.csv': 'landmarks',
  };
  for (const [path, kind] of Object.entries(kinds)) expect([path, kindOf(path)]).toEqual([path, kind]);
});

test('litter of the system is not opened', () => {
  expect(['.DS_Store', 'a/.git/x.png', '__MACOSX/a.png', 'a/Thumbs.db'].every(isLitter)).toBe(true);
  expect(isLitter('a/frame.png')).toBe(false);
});

test('the folder with most pictures is the sequence', () => {
  expect(mainFolder(['d/logo.png', 'd/frames/1.png', 'd/frames/2.png'])).toEqual(['d/frames/1.png', 'd/frames/2.png']);
});
