// Colours of pieces: hues far from those before, in three tones, so that many differ; numbers and seams say the same without colour.

const GOLDEN = 137.508;
const TONES = [[0.78, 0.12], [0.66, 0.13], [0.86, 0.09]];

// After Ottosson's "A perceptual color space for image processing" (2020), clipped.
function fromOklch(lightness, chroma, hue) {
  const [a, b] = [chroma * Math.cos(hue), chroma * Math.sin(hue)];
  const [l, m, s] = [lightness + 0.3963377774 * a + 0.2158037573 * b, lightness - 0.1055613458 * a - 0.0638541728 * b, lightness - 0.0894841775 * a - 1.291485548 * b].map((x) => x ** 3);
  const linear = [4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s, -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s, -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s];
  return linear.map((x) => Math.max(0, Math.min(1, x)));
}

const made = new Map();

/** Linear red, green and blue of a piece, 0 to 255. */
export function colour(piece) {
  if (!made.has(piece)) {
    const [lightness, chroma] = TONES[piece % TONES.length];
    made.set(piece, fromOklch(lightness, chroma, ((40 + GOLDEN * piece) * Math.PI) / 180).map((x) => Math.round(255 * x)));
  }
  return made.get(piece);
}

/** The same for style sheets. */
export function css(piece) {
  const encoded = colour(piece).map((x) => Math.round(255 * (x / 255 <= 0.0031308 ? 12.92 * (x / 255) : 1.055 * (x / 255) ** (1 / 2.4) - 0.055)));
  return `rgb(${encoded.join(" ")})`;
}
