/** Recordings of ROS 2 without chunks, as the smallest writers make them: MCAP records around CDR messages. */

const MAGIC = Buffer.from('\x89MCAP0\r\n', 'latin1');

const u16 = (value: number) => Buffer.from([value & 255, value >> 8]);
function u32(value: number): Buffer {
  const bytes = Buffer.alloc(4);
  bytes.writeUInt32LE(value >>> 0);
  return bytes;
}
function u64(value: bigint): Buffer {
  const bytes = Buffer.alloc(8);
  bytes.writeBigUInt64LE(value);
  return bytes;
}
const text = (value: string) => Buffer.concat([u32(Buffer.byteLength(value)), Buffer.from(value)]);
const record = (kind: number, body: Buffer) => Buffer.concat([Buffer.from([kind]), u64(BigInt(body.length)), body]);

/** One message in CDR, field by field. */
class Message {
  #parts: Buffer[] = [];
  #length = 0;

  #put(bytes: Buffer, size: number): this {
    const fill = (size - (this.#length % size)) % size;
    this.#parts.push(Buffer.alloc(fill), bytes);
    this.#length += fill + bytes.length;
    return this;
  }
  byte = (value: number) => this.#put(Buffer.from([value]), 1);
  int = (value: number) => this.#put(u32(value), 4);
  string = (value: string) => this.int(Buffer.byteLength(value) + 1).#put(Buffer.from(`${value}\0`), 1);
  bytes = (value: Buffer) => this.int(value.length).#put(value, 1);
  numbers(...values: number[]): this {
    for (const value of values) {
      const bytes = Buffer.alloc(8);
      bytes.writeDoubleLE(value);
      this.#put(bytes, 8);
    }
    return this;
  }
  header = (time: number, frame: string) => this.int(Math.floor(time)).int(Math.round((time % 1) * 1e9)).string(frame);
  get data(): Buffer {
    return Buffer.concat([Buffer.from([0, 1, 0, 0]), ...this.#parts]);
  }
}

const TOPICS = [
  ['/camera/image_raw', 'sensor_msgs/msg/Image'],
  ['/camera/camera_info', 'sensor_msgs/msg/CameraInfo'],
  ['/odom', 'nav_msgs/msg/Odometry'],
  ['/tf_static', 'tf2_msgs/msg/TFMessage'],
  ['/noise', 'std_msgs/msg/String'],
] as const;
const [IMAGE, CAMERA, ODOMETRY, TRANSFORM, NOISE] = [0, 1, 2, 3, 4];
const SIZE = { width: 320, height: 240, focal: 365 };

/** What goes before the messages. */
function head(): Buffer {
  const channels = TOPICS.flatMap(([topic, kind], index) => [
    record(3, Buffer.concat([u16(index + 1), text(kind), text('ros2msg'), text('')])),
    record(4, Buffer.concat([u16(index), u16(index + 1), text(topic), text('cdr'), u32(0)])),
  ]);
  return Buffer.concat([MAGIC, record(1, Buffer.concat([text('ros2'), text('test')])), ...channels]);
}

const tail = () => Buffer.concat([record(15, u32(0)), record(2, Buffer.concat([u64(0n), u64(0n), u32(0)])), MAGIC]);

function message(topic: number, time: number, data: Buffer): Buffer {
  const at = u64(BigInt(Math.round(time * 1e9)));
  return record(5, Buffer.concat([u16(topic), u32(0), at, at, data]));
}

/** Pictures of 320 × 240 in grey, 10 a second, of a robot that drives ahead at 0.5 m/s with its camera 0.4 m up, 12° down. */
export function drive(pictures: Buffer[], options: { transform?: boolean; camera?: boolean } = {}): Buffer {
  const { width, height, focal } = SIZE;
  const messages: Buffer[] = [];
  // The optical frame's axes on the robot's: about y by 12°, then z ahead, x right, y down.
  const turn = (12 * Math.PI) / 180;
  const [s, c] = [Math.sin(turn / 2) / 2, Math.cos(turn / 2) / 2];
  const link = new Message().int(1).header(0, 'base_link').string('camera_optical').numbers(0.1, 0, 0.4, -c - s, c + s, -c + s, c - s);
  if (options.transform !== false) messages.push(message(TRANSFORM, 0, link.data));
  const matrix = [focal, 0, 160, 0, focal, 120, 0, 0, 1];
  const camera = new Message().header(0, 'camera_optical').int(height).int(width).string('plumb_bob').int(5).numbers(0, 0, 0, 0, 0, ...matrix,
    1, 0, 0, 0, 1, 0, 0, 0, 1, focal, 0, 160, 0, 0, focal, 120, 0, 0, 0, 1, 0).int(0).int(0).int(0).int(0).int(0).int(0).byte(0);
  if (options.camera !== false) messages.push(message(CAMERA, 0, camera.data));
  for (let k = 0; k <= pictures.length; k += 1) {
    const moved = new Message().header(k / 10, 'odom').string('base_link').numbers(k / 20, 0, 0, 0, 0, 0, 1, ...Array<number>(36).fill(0), 0.5, 0, 0, 0, 0, 0, ...Array<number>(36).fill(0));
    messages.push(message(ODOMETRY, k / 10, moved.data));
  }
  pictures.forEach((grey, k) => {
    const image = new Message().header(k / 10, 'camera_optical').int(height).int(width).string('mono8').byte(0).int(width).bytes(grey);
    messages.push(message(IMAGE, k / 10, image.data));
  });
  return Buffer.concat([head(), ...messages, tail()]);
}

/** Where the records of so many large messages begin that nobody wants, what stands there, and how long the file is: the rest is zeros. */
export function large(count: number, size: number): { pieces: [number, Buffer][]; length: number } {
  const start = head();
  const pieces: [number, Buffer][] = [[0, start]];
  let at = start.length;
  for (let k = 0; k < count; k += 1) {
    pieces.push([at, Buffer.concat([Buffer.from([5]), u64(BigInt(22 + size)), u16(NOISE), Buffer.alloc(20)])]);
    at += 9 + 22 + size;
  }
  pieces.push([at, tail()]);
  return { pieces, length: at + tail().length };
}
