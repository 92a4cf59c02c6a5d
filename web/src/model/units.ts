/** Numbers in words: always with their unit, with as many digits as their uncertainty leaves. */

const MINUS = '−';

function fixed(value: number, digits: number): string {
  const text = Math.abs(value).toFixed(digits);
  return value < 0 && Number(text) !== 0 ? MINUS + text : text;
}

/** Digits after the point that a standard deviation in metres leaves meaningful, 1 to 3. */
function digitsFor(std: number): number {
  if (!(std > 0)) return 2;
  return Math.min(3, Math.max(1, Math.ceil(-Math.log10(std))));
}

/** "2.47 m ± 0.03". */
export function metres(value: number, std?: number): string {
  const digits = std === undefined ? 2 : digitsFor(std);
  return std === undefined ? `${fixed(value, digits)} m` : `${fixed(value, digits)} m ± ${std.toFixed(digits)}`;
}

/** "±3.1 cm", or metres from 1 m up. */
export function plusMinus(std: number): string {
  return std < 1 ? `±${(std * 100).toFixed(std < 0.1 ? 1 : 0)} cm` : `±${std.toFixed(1)} m`;
}

/** "12.3° left". */
export function bearing(radians: number): string {
  const degrees = (radians * 180) / Math.PI;
  const size = Math.abs(degrees).toFixed(1);
  if (size === '0.0') return 'straight ahead';
  return `${size}° ${degrees > 0 ? 'left' : 'right'}`;
}

/** "6.2 ms". */
export function milliseconds(value: number): string {
  return `${value.toFixed(value < 10 ? 1 : 0)} ms`;
}

/** "about 12 s left". */
export function timeLeft(seconds: number): string {
  if (seconds < 1) return 'less than 1 s left';
  if (seconds < 90) return `about ${Math.ceil(seconds)} s left`;
  return `about ${Math.ceil(seconds / 60)} min left`;
}

/** "1 picture", "2 pictures". */
export function count(number: number, noun: string): string {
  return `${number.toLocaleString('en')} ${noun}${number === 1 ? '' : 's'}`;
}

/** A short plain number for axes. */
export function axisNumber(value: number): string {
  return Number(value.toPrecision(3)).toString().replace('-', MINUS);
}
