// What the translated code uses of scipy, scikit-learn and ArviZ.

const ROOT_TWO_PI = Math.sqrt(2 * Math.PI);

// erfc: Kummer's series of erf where it is short, the continued fraction beyond; to some units of the last place.
function erfc(x) {
  if (Number.isNaN(x)) return NaN;
  if (x < 0) return 2 - erfc(-x);
  if (x < 2.5) {
    let term = x, sum = x;
    for (let n = 1; term > 1e-18 * sum; n++) { term *= (2 * x * x) / (2 * n + 1); sum += term; }
    return 1 - (2 / Math.sqrt(Math.PI)) * Math.exp(-x * x) * sum;
  }
  if (x > 27) return 0;
  let fraction = 0;
  for (let n = 120; n > 0; n--) fraction = n / 2 / (x + fraction);
  return Math.exp(-x * x) / Math.sqrt(Math.PI) / (x + fraction);
}

const ndtr = (x) => 0.5 * erfc(-x / Math.SQRT2);

// Acklam's approximation, then Halley's steps with erfc.
function ndtri(p) {
  if (!(p > 0 && p < 1)) return p === 0 ? -Infinity : p === 1 ? Infinity : NaN;
  if (p > 0.5) return -ndtri(1 - p);
  const t = Math.sqrt(-2 * Math.log(p));
  let x = -(t - (2.515517 + t * (0.802853 + t * 0.010328)) / (1 + t * (1.432788 + t * (0.189269 + t * 0.001308))));
  for (let k = 0; k < 4; k++) {
    const miss = (ndtr(x) - p) * ROOT_TWO_PI * Math.exp(0.5 * x * x);
    x -= miss / (1 + 0.5 * x * miss);
  }
  return x;
}

function gammaln(x) { // Lanczos (g = 7)
  const c = [0.99999999999980993, 676.5203681218851, -1259.1392167224028, 771.32342877765313, -176.61502916214059,
    12.507343278686905, -0.13857109526572012, 9.9843695780195716e-6, 1.5056327351493116e-7];
  const t = x + 6.5;
  return 0.5 * Math.log(2 * Math.PI) + (x - 0.5) * Math.log(t) - t + Math.log(c.slice(1).reduce((sum, part, k) => sum + part / (x + k), c[0]));
}

function gammaTails(a, x) { // regularised, P(a, x) and Q(a, x), the smaller of them to its own last places
  if (x <= 0) return [0, 1];
  const scale = Math.exp(a * Math.log(x) - x - gammaln(a));
  if (x < a + 1) {
    let term = 1 / a, sum = term;
    for (let n = 1; n < 1000 && term > 1e-17 * sum; n++) { term *= x / (a + n); sum += term; }
    return [scale * sum, 1 - scale * sum];
  }
  let b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (let n = 1; n < 1000; n++) {
    const an = -n * (n - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    h *= d * c;
    if (Math.abs(d * c - 1) < 1e-16) break;
  }
  return [1 - scale * h, scale * h];
}

// P(a, x) = p, from the normal approximation of its cube root (Wilson and Hilferty) on, by Halley's steps.
function gammaincinv(a, p) {
  if (!(p > 0 && p < 1)) return p === 0 ? 0 : p === 1 ? Infinity : NaN;
  const root = 1 - 1 / (9 * a) + ndtri(p) / (3 * Math.sqrt(a));
  let x = root > 0.2 ? a * root ** 3 : Math.exp((Math.log(p) + gammaln(a + 1)) / a);
  for (let k = 0, step = x; k < 30 && Math.abs(step) > 1e-14 * x; k++) {
    const [low, high] = gammaTails(a, x), miss = p < 0.5 ? low - p : 1 - p - high;
    step = miss / Math.exp((a - 1) * Math.log(x) - x - gammaln(a));
    x = Math.max(x - step / (1 - 0.5 * Math.min(1, step * ((a - 1) / x - 1))), 0.5 * x);
  }
  return x;
}

const special = {
  chdtrc: (freedom, a) => unary((value) => gammaTails(freedom / 2, value / 2)[1], a),
  gammaincinv: (a, p) => unary((x) => gammaincinv(a, x), p), gammaln: (a) => unary(gammaln, a),
  ndtr: (a) => unary(ndtr, a), ndtri: (a) => unary(ndtri, a),
  expit: (a) => unary((x) => 1 / (1 + Math.exp(-x)), a),
  log_expit: (a) => unary((x) => (x < 0 ? x - Math.log1p(Math.exp(x)) : -Math.log1p(Math.exp(-x))), a),
  logsumexp(a, ...given) {
    const { axis = null, b, keepdims = false } = options(given, ["axis", "b", "keepdims"]), array = toNd(a);
    const weights = b === undefined ? null : broadcastTo(toNd(b), array.shape);
    const top = np.max(array, kw({ axis, keepdims: true }));
    const shift = np.where(np.isfinite(top), top, 0);
    const parts = np.exp(py.sub(array, shift)), sum = np.sum(weights ? py.mul(parts, weights) : parts, kw({ axis, keepdims }));
    const back = shift instanceof Nd ? np.reshape(shift, sum instanceof Nd ? sum.shape : []) : shift;
    return py.add(np.log(sum), back instanceof Nd && !back.ndim ? back.data[back.offset] : back);
  },
};

const stats = {
  NormalDist: () => ({ inv_cdf: special.ndtri }),
  student_law: (mean, shape, df) => new StudentLaw(mean, shape, df),
};

class StudentLaw {
  constructor(mean, shape, df) {
    Object.assign(this, { mean, df, lower: np.linalg.cholesky(shape) });
    const d = mean.size, diagonal = np.diag(this.lower);
    this.constant = gammaln((df + d) / 2) - gammaln(df / 2) - (d / 2) * Math.log(df * Math.PI) - np.sum(np.log(diagonal));
  }
  rvs(size, rng) {
    const d = this.mean.size;
    const out = np.matmul(rng.standard_normal([size, d]), this.lower.T);
    for (let k = 0; k < size; k++) {
      let chi = 0;
      for (let j = 0; j < this.df; j++) chi += rng.normal() ** 2; // whole degrees of freedom
      const factor = Math.sqrt(this.df / chi);
      for (let j = 0; j < d; j++) out.data[k * d + j] *= factor;
    }
    return py.add(out, this.mean);
  }
  logpdf(x) {
    const d = this.mean.size, z = whitened(this.lower, py.sub(x, this.mean)), distance = np.sum(py.mul(z, z), kw({ axis: 1 }));
    return unary((q) => this.constant - 0.5 * (this.df + d) * Math.log1p(q / this.df), distance);
  }
}

const optimize = {
  brentq(f, low, high, named) { // bisection: slower, and to the same tolerance
    let [a, b] = [low, high];
    const rising = f(b) > 0;
    while (b - a > (named?.values.xtol ?? 2e-12)) {
      const middle = 0.5 * (a + b);
      if (f(middle) > 0 === rising) b = middle;
      else a = middle;
    }
    return 0.5 * (a + b);
  },
};
