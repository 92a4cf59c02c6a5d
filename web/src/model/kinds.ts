/** What a file is for, by its name, as far as the page must know before it is opened. */
export const PICTURE = /\.(png|jpe?g|webp|bmp|gif|avif|heic|heif|pgm|ppm|pnm|pbm|tiff?)$/i;
export const VIDEO = /\.(mp4|m4v|webm|mov|mkv|ogv|avi)$/i;
export const CALIBRATION = /\.(toml|ya?ml|xml)$/i;
/** A recording of ROS 2. */
export const RECORDING = /\.(mcap|db3)$/i;
/** A file that holds many. */
export const CONTAINER = /\.(zip|mcap|db3)$/i;
