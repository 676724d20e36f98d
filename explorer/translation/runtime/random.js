// Random numbers, reproducible by their seed and other than numpy's; those that belong to rows are Python's own.

class Random { // sfc32 (Doty-Humphrey), of PractRand
  constructor(seed) {
    const mix = hashed(String(seed));
    this.state = Uint32Array.of(mix(), mix(), mix(), 1);
    for (let k = 0; k < 16; k++) this.bits();
    this.spare = null;
  }
  bits() {
    const s = this.state, out = (s[0] + s[1] + s[3]) | 0;
    s[3] += 1;
    s[0] = s[1] ^ (s[1] >>> 9);
    s[1] = (s[2] + (s[2] << 3)) | 0;
    s[2] = ((s[2] << 21) | (s[2] >>> 11)) + out;
    return out >>> 0;
  }
  next() { return ((this.bits() >>> 5) * 67108864 + (this.bits() >>> 6)) / 9007199254740992; }
  normal() { // by pairs, Marsaglia's polar method
    if (this.spare !== null) { const kept = this.spare; this.spare = null; return kept; }
    for (;;) {
      const x = 2 * this.next() - 1, y = 2 * this.next() - 1, r = x * x + y * y;
      if (r > 0 && r < 1) {
        const factor = Math.sqrt((-2 * Math.log(r)) / r);
        this.spare = y * factor;
        return x * factor;
      }
    }
  }
  filled(shape, draw) {
    if (shape === undefined) return draw();
    const out = made(listed(shape));
    for (let k = 0; k < out.data.length; k++) out.data[k] = draw();
    return out;
  }
  random(shape) { return this.filled(shape, () => this.next()); }
  standard_normal(shape) { return this.filled(shape, () => this.normal()); }
  permutation(a) {
    const out = a.copy();
    for (let k = out.size - 1; k > 0; k--) {
      const j = Math.floor(this.next() * (k + 1));
      [out.data[k], out.data[j]] = [out.data[j], out.data[k]];
    }
    return out;
  }
}

function hashed(words) { // xmur3
  let h = 1779033703 ^ words.length;
  for (const sign of words) { h = Math.imul(h ^ sign.codePointAt(0), 3432918353); h = (h << 13) | (h >>> 19); }
  return () => {
    h = Math.imul(h ^ (h >>> 16), 2246822507);
    h = Math.imul(h ^ (h >>> 13), 3266489909);
    return (h ^= h >>> 16) >>> 0;
  };
}

np.random = { default_rng: (seed) => new Random(seed) };
const seeds = {
  generator: (...name) => new Random(name.join("/")),
  integer_seed: (...name) => hashed(name.join("/"))(),
  row_numbers(values, stream) { // whole numbers of 64 bits; doubles hold 53
    const words = new BigUint64Array(Float64Array.from(flat(values)).buffer), [n, k] = values.shape;
    return py.range(n).map((i) => words.subarray(i * k, (i + 1) * k).reduce((number, word) => splitMix(number ^ word), BigInt(stream)));
  },
  uniform(numbers, draw, width) {
    const out = made([numbers.length, width]);
    for (let k = 0; k < out.size; k++) {
      const state = numbers[Math.floor(k / width)] + GOLDEN_STEP * BigInt(draw * width + 1 + (k % width));
      out.data[k] = (Number(splitMix(state) >> 11n) + 0.5) * 2 ** -53;
    }
    return out;
  },
};

const GOLDEN_STEP = 0x9e3779b97f4a7c15n, of64 = (number) => BigInt.asUintN(64, number);
function splitMix(number) { // the output of SplitMix64
  number = of64(number + GOLDEN_STEP);
  number = of64((number ^ (number >> 30n)) * 0xbf58476d1ce4e5b9n);
  number = of64((number ^ (number >> 27n)) * 0x94d049bb133111ebn);
  return number ^ (number >> 31n);
}
