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

function upperGamma(a, x) { // regularised, Q(a, x)
  if (x <= 0) return 1;
  const scale = Math.exp(a * Math.log(x) - x - gammaln(a));
  if (x < a + 1) {
    let term = 1 / a, sum = term;
    for (let n = 1; n < 1000 && term > 1e-17 * sum; n++) { term *= x / (a + n); sum += term; }
    return 1 - scale * sum;
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
  return scale * h;
}

const special = {
  ndtr: (a) => unary(ndtr, a), ndtri: (a) => unary(ndtri, a),
  expit: (a) => unary((x) => 1 / (1 + Math.exp(-x)), a),
  log_expit: (a) => unary((x) => (x < 0 ? x - Math.log1p(Math.exp(x)) : -Math.log1p(Math.exp(-x))), a),
  logsumexp(a, ...given) {
    const { axis, b } = options(given, ["axis", "b"]), array = toNd(a);
    const weights = b === undefined ? null : broadcastTo(toNd(b), array.shape);
    const top = np.max(array, kw({ axis: axis ?? null, keepdims: true }));
    const shift = np.where(np.isfinite(top), top, 0);
    const parts = np.exp(py.sub(array, shift)), sum = np.sum(weights ? py.mul(parts, weights) : parts, kw({ axis: axis ?? null }));
    const back = shift instanceof Nd ? np.reshape(shift, sum instanceof Nd ? sum.shape : []) : shift;
    return py.add(np.log(sum), back instanceof Nd && !back.ndim ? back.data[back.offset] : back);
  },
};

const stats = {
  NormalDist: () => ({ inv_cdf: special.ndtri }),
  chi2: { sf: (x, freedom) => unary((value) => upperGamma(freedom / 2, value / 2), x) },
  multivariate_t: (mean, shape, named) => new MultivariateT(mean, shape, named.values.df),
};

class MultivariateT {
  constructor(mean, shape, df) {
    Object.assign(this, { mean, df, lower: np.linalg.cholesky(shape) });
    const d = mean.size, diagonal = np.diag(this.lower);
    this.constant = gammaln((df + d) / 2) - gammaln(df / 2) - (d / 2) * Math.log(df * Math.PI) - np.sum(np.log(diagonal));
  }
  rvs(named) {
    const { size, random_state: rng } = named.values, d = this.mean.size;
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

// Expectation and maximisation of a normal mixture with full covariances.
const mixture = {
  GaussianMixture: (components, named) => ({
    fit(x) {
      const rng = np.random.default_rng(named.values.random_state), n = x.shape[0], d = x.shape[1];
      let shares = nearestSeeds(x, components, rng), model = null, before = -Infinity;
      for (let round = 0; round < 100; round++) {
        model = maximised(x, shares, named.values.reg_covar);
        const logs = np.stack(model.map((part) => {
          const lower = np.linalg.cholesky(part.covariance), z = whitened(lower, py.sub(x, part.mean));
          const constant = Math.log(part.weight) - np.sum(np.log(np.diag(lower))) - (d / 2) * Math.log(2 * Math.PI);
          return py.sub(constant, py.mul(0.5, np.sum(py.mul(z, z), kw({ axis: 1 }))));
        }));
        const whole = special.logsumexp(logs, kw({ axis: 0 })), mean = np.mean(whole);
        shares = np.exp(py.sub(logs, whole));
        if (Math.abs(mean - before) < 1e-3) break;
        before = mean;
      }
      return {
        means_: np.stack(model.map((part) => part.mean)), covariances_: np.stack(model.map((part) => part.covariance)),
        weights_: np.array(model.map((part) => part.weight)), n_: n,
      };
    },
  }),
};

function maximised(x, shares, ridge) {
  const [n, d] = x.shape;
  return Array.from(shares, (share) => {
    const sum = np.sum(share) + 1e-9, mean = py.div(np.matmul(share, x), sum), centred = py.sub(x, mean);
    const covariance = py.div(np.matmul(centred.T, py.mul(centred, np.reshape(share, [n, 1]))), sum);
    return { weight: sum / n, mean, covariance: py.add(covariance, py.mul(ridge, np.eye(d))) };
  });
}

function nearestSeeds(x, count, rng) { // k-means++ and some rounds of k-means, as shares of 0 and 1
  const [n, d] = x.shape, values = flat(x), sd = flat(np.std(x, kw({ axis: 0 })));
  const apart = (i, centre) => { let sum = 0; for (let j = 0; j < d; j++) sum += ((values[i * d + j] - centre[j]) / sd[j]) ** 2; return sum; };
  const row = (i) => values.slice(i * d, (i + 1) * d), centres = [row(Math.floor(rng.next() * n))];
  while (centres.length < count) {
    const sums = np.cumsum(np.array(py.range(n).map((i) => Math.min(...centres.map((c) => apart(i, c)))))), at = rng.next() * sums.data[n - 1];
    centres.push(row(py.min(n - 1, np.searchsorted(sums, at))));
  }
  let nearest = [];
  for (let round = 0; round < 20; round++) {
    nearest = py.range(n).map((i) => centres.reduce((at, c, k) => (apart(i, c) < apart(i, centres[at]) ? k : at), 0));
    centres.forEach((centre, k) => {
      const own = nearest.flatMap((at, i) => (at === k ? [i] : []));
      if (own.length) for (let j = 0; j < d; j++) centre[j] = own.reduce((sum, i) => sum + values[i * d + j], 0) / own.length;
    });
  }
  return np.array(centres.map((_, k) => nearest.map((at) => Number(at === k))));
}

// arviz.psislw of one vector: Pareto smoothed importance sampling (Vehtari et al. 2024), normalised.
function paretoSmoothed(logRatios) {
  const n = logRatios.size, top = np.max(logRatios), x = flat(logRatios).map((value) => value - top);
  const order = flat(np.argsort(new Nd(x, [n]))), cut = Math.ceil(Math.min(n / 5, 3 * Math.sqrt(n))) + 1;
  const cutoff = Math.max(x[order[n - cut]], Math.log(2.2250738585072014e-308)), low = Math.exp(cutoff);
  const tail = Array.from(order).filter((k) => x[k] > cutoff);
  let k = Infinity;
  if (tail.length > 4) {
    const fit = fittedPareto(Float64Array.from(tail, (place) => Math.exp(x[place]) - low));
    k = fit.k;
    if (Number.isFinite(k)) {
      tail.forEach((place, j) => {
        const level = (j + 0.5) / tail.length, raised = -Math.log1p(-level);
        const value = fit.sigma <= 0 ? NaN : fit.sigma * (Math.abs(k) < 2.220446049250313e-16 ? raised : Math.expm1(k * raised) / k);
        x[place] = Math.min(0, Math.log(value + low));
      });
    }
  }
  const weights = new Nd(x, [n]);
  return [py.sub(weights, special.logsumexp(weights)), k];
}

function fittedPareto(tail) { // Zhang and Stephens (2009), with a weak prior of the shape
  const n = tail.length, points = 30 + Math.floor(Math.sqrt(n)), quarter = tail[Math.floor(n / 4 + 0.5) - 1];
  const b = py.range(points).map((j) => (1 - Math.sqrt(points / (j + 0.5))) / (3 * quarter) + 1 / tail[n - 1]);
  const shape = (value) => total(tail.map((x) => Math.log1p(-value * x))) / n;
  const heights = b.map((value) => { const k = shape(value); return n * (Math.log(-(value / k)) - k - 1); });
  let weights = heights.map((own) => 1 / heights.reduce((sum, other) => sum + Math.exp(other - own), 0));
  weights = weights.map((w) => (w >= 10 * 2.220446049250313e-16 ? w : 0));
  const sum = weights.reduce((x, y) => x + y), mean = b.reduce((x, value, j) => x + (value * weights[j]) / sum, 0), k = shape(mean);
  return { k: (n * k + 5) / (n + 10), sigma: -k / mean };
}
