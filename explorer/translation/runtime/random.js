// Random numbers, reproducible by their seed; other ones than numpy's.

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
const seeds = { generator: (...name) => new Random(name.join("/")), integer_seed: (...name) => hashed(name.join("/"))() };
