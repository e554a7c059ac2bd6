// Pixels: unpacks the images of the page, shows them at an exposure, and computes error maps.

/** The values of half floats, indexed by their 16 bits. */
const HALF = Float32Array.from({ length: 65536 }, (_, bits) => {
  const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, mantissa = bits & 1023;
  if (exponent === 31) return mantissa ? NaN : sign * Infinity;
  return sign * (exponent ? 2 ** (exponent - 15) * (1 + mantissa / 1024) : 2 ** -24 * mantissa);
});

/** Colors of an error map from zero to the largest shown error, evenly spaced and of increasing lightness. */
const HEAT = [[0, 0, 0], [58, 16, 96], [146, 34, 110], [222, 76, 68], [250, 156, 52], [255, 248, 200]];
const HEAT_STEPS = 1024;
const NOT_FINITE = [255, 0, 255]; // color of values that are not finite

/** The colors of HEAT_STEPS errors from 0 to 1, interpolated linearly. */
const HEATS = Array.from({ length: HEAT_STEPS }, (_, step) => {
  const position = step / (HEAT_STEPS - 1) * (HEAT.length - 1), i = Math.min(Math.floor(position), HEAT.length - 2);
  return HEAT[i].map((channel, k) => Math.round(channel + (position - i) * (HEAT[i + 1][k] - channel)));
});

/** Returns the color of an error; errors above 1 have the lightest color. */
const heat = (error) => (error < Infinity ? HEATS[Math.round(Math.min(error, 1) * (HEAT_STEPS - 1))] : NOT_FINITE);

const sRgb = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);

/** Returns an image of the page: { width, height, bits }, with three half floats per pixel. */
async function unpack(number) {
  const script = document.querySelector(`script[data-pixels="${number}"]`);
  const width = Number(script.dataset.width), height = Number(script.dataset.height), count = width * height * 3;
  const deflated = Uint8Array.from(atob(script.textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const bits = new Uint16Array(count);
  for (let i = 0; i < count; ++i) { // differences to the left neighbor; all high bytes first
    const left = i % (width * 3) < 3 ? 0 : bits[i - 3];
    bits[i] = left + (bytes[i] << 8) + bytes[count + i];
  }
  return { width, height, bits };
}

const unpacked = new Map();

/** Returns an image of the page and unpacks it on first use. */
function imageOf(number) {
  if (!unpacked.has(number)) unpacked.set(number, unpack(number));
  return unpacked.get(number);
}

/** Returns a canvas of an image's size. paint(pixel, rgba) sets the color of each pixel at rgba[4 * pixel]. */
function painted(image, paint) {
  const canvas = make("canvas", { width: image.width, height: image.height });
  const context = canvas.getContext("2d"), data = context.createImageData(image.width, image.height);
  data.data.fill(255);
  for (let pixel = 0; pixel < image.width * image.height; ++pixel) paint(pixel, data.data);
  context.putImageData(data, 0, 0);
  return canvas;
}

let tones = { stops: NaN, bytes: null };

/** Returns the sRGB bytes of all half floats at an exposure. */
function tonesAt(stops) {
  if (tones.stops !== stops) {
    tones = { stops, bytes: Uint8ClampedArray.from(HALF, (value) => 255 * sRgb(Math.max(0, value) * 2 ** stops)) };
  }
  return tones.bytes;
}

/** Returns a canvas with an image at an exposure in stops. */
function picture({ bits, ...size }, stops) {
  const bytes = tonesAt(stops);
  return painted(size, (pixel, rgba) => {
    const offset = 3 * pixel, finite = [0, 1, 2].every((k) => (bits[offset + k] & 0x7c00) !== 0x7c00);
    for (let k = 0; k < 3; ++k) rgba[4 * pixel + k] = finite ? bytes[bits[offset + k]] : NOT_FINITE[k];
  });
}

/** Returns the error of each pixel: the mean of |image - reference| over R, G and B. A relative error is divided by the mean
 *  of the reference pixel plus 1 % of the mean of the reference, which avoids division by zero. */
function errors(image, reference, relative) {
  const count = reference.bits.length / 3, levels = new Float32Array(count), result = new Float32Array(count);
  let sum = 0, finite = 0;
  for (let i = 0; i < count; ++i) {
    for (let k = 3 * i; k < 3 * i + 3; ++k) {
      levels[i] += HALF[reference.bits[k]] / 3;
      result[i] += Math.abs(HALF[image.bits[k]] - HALF[reference.bits[k]]) / 3;
    }
    if (Number.isFinite(levels[i])) [sum, finite] = [sum + levels[i], finite + 1];
  }
  if (!relative) return result;
  const floor = Math.max(0.01 * sum / finite, Number.MIN_VALUE);
  return result.map((error, i) => error / (Math.abs(levels[i]) + floor));
}

/** Returns a canvas with the errors of an image; 1 / 2^stops has the lightest color. */
function errorMap(image, reference, relative, stops) {
  const values = errors(image, reference, relative), gain = 2 ** stops;
  return painted(reference, (pixel, rgba) => {
    const color = heat(values[pixel] * gain);
    for (let k = 0; k < 3; ++k) rgba[4 * pixel + k] = color[k];
  });
}
