// What the translated code uses of numpy.

const np = { inf: Infinity, nan: NaN, pi: Math.PI, newaxis: null };

// --- making

function nestedShape(value) {
  if (value instanceof Nd) return value.shape;
  if (!Array.isArray(value)) return [];
  return value.length ? [value.length, ...nestedShape(value[0])] : [0];
}

function kindNamed(type) {
  if (type === undefined || type === null || type === py.float) return "f";
  return type === py.int ? "i" : type === py.bool ? "b" : type;
}

Object.assign(np, {
  float64: py.float, int64: py.int, bool_: py.bool, int8: py.int, intp: py.int, str_: py.str, object_: py.str,
  array(value, named) {
    const type = named instanceof Keywords ? named.values.dtype : named;
    if (value instanceof Nd) return value.copy();
    const list = Array.isArray(value) ? value : [...value];
    if (typeof list[0] === "string" || type === py.str) return new Texts(list);
    const shape = nestedShape(list), out = made(shape, "f"), kinds = new Set();
    let place = 0;
    const fill = (part) => {
      if (part instanceof Nd) {
        kinds.add(part.kind);
        out.data.set(flat(part), place);
        place += part.size;
      } else if (Array.isArray(part)) part.forEach(fill);
      else {
        kinds.add(kindOf(part));
        out.data[place++] = part;
      }
    };
    fill(list);
    if (place !== out.data.length) throw new ValueError("a list of lists of different lengths is no array");
    out.kind = type ? kindNamed(type) : kinds.has("f") || !kinds.size ? "f" : kinds.has("i") ? "i" : "b";
    return out;
  },
  asarray(value, type) {
    const kind = type instanceof Keywords ? type.values.dtype : type;
    if (value instanceof Texts) return value;
    if (typeof value === "number" || typeof value === "boolean") return value;
    const out = value instanceof Nd ? value : np.array(value);
    if (kind === undefined || kindNamed(kind) === out.kind) return out;
    const wanted = kindNamed(kind);
    return unary(wanted === "i" ? Math.trunc : wanted === "b" ? (x) => x !== 0 : (x) => x, out, wanted);
  },
  ascontiguousarray: (a) => (isContiguous(a) ? a : a.copy()),
  atleast_2d: (a) => (toNd(a).ndim < 2 ? np.reshape(toNd(a), [1, -1]) : a),
  frombuffer: (bytes) => new Nd(bytes.values, [bytes.values.length]),
  zeros: (shape, type) => made(listed(shape), kindNamed(type instanceof Keywords ? type.values.dtype : type)),
  ones: (...given) => fill(np.zeros(...given), 1),
  empty: (...given) => np.zeros(...given),
  full: (shape, value, type) => fill(np.zeros(shape, type ?? kindOf(value)), value),
  zeros_like: (a) => made(a.shape.slice(), a.kind),
  empty_like: (a) => made(a.shape.slice(), a.kind),
  ones_like: (a) => fill(made(a.shape.slice(), a.kind), 1),
  full_like: (a, value) => fill(made(a.shape.slice(), "f"), value),
  arange(...given) { const list = py.range(...given); return new Nd(Float64Array.from(list), [list.length], "i"); },
  linspace(start, stop, count) {
    const out = made([count]), step = (stop - start) / (count - 1);
    for (let k = 0; k < count; k++) out.data[k] = k * step + start;
    out.data[count - 1] = stop;
    return out;
  },
  eye(n) { const out = made([n, n]); for (let k = 0; k < n; k++) out.data[k * (n + 1)] = 1; return out; },
  diag(a) {
    const out = a.ndim === 1 ? made([a.size, a.size]) : null;
    if (!out) return np.array(py.range(Math.min(...a.shape)).map((k) => getItem(a, k, k)));
    flat(a).forEach((value, k) => { out.data[k * (a.size + 1)] = value; });
    return out;
  },
  tile(a, times) {
    const counts = listed(times);
    let out = a;
    while (out.ndim < counts.length) out = np.reshape(out, [1, ...out.shape]);
    counts.forEach((count, axis) => { out = np.concatenate(new Array(count).fill(out), kw({ axis })); });
    return out;
  },
});

function listed(shape) { return Array.isArray(shape) ? shape.slice() : [shape]; }
function fill(out, value) { out.data.fill(value); return out; }

// --- element by element

const unaries = {
  sqrt: Math.sqrt, exp: Math.exp, log: Math.log, log1p: Math.log1p, expm1: Math.expm1, tanh: Math.tanh, cbrt: Math.cbrt,
  log10: Math.log10, cos: Math.cos, sin: Math.sin, sign: Math.sign, floor: Math.floor, ceil: Math.ceil, rint: py.round,
  square: (x) => x * x, fabs: Math.abs,
};
for (const [name, f] of Object.entries(unaries)) np[name] = (a) => unary(f, a);
Object.assign(np, {
  abs: py.abs, absolute: py.abs, negative: py.neg, add: py.add, multiply: py.mul, power: py.pow,
  round: (a, digits = 0) => unary((x) => (digits ? Number(fixed(x, digits)) : py.round(x)), a),
  isnan: (a) => unary((x) => Number.isNaN(x), a, "b"),
  isfinite: (a) => unary((x) => Number.isFinite(x), a, "b"),
  isinf: (a) => unary((x) => x === Infinity || x === -Infinity, a, "b"),
  maximum: (a, b) => binary((x, y) => Math.max(x, y), a, b, resultKind(a, b)),
  minimum: (a, b) => binary((x, y) => Math.min(x, y), a, b, resultKind(a, b)),
  hypot: (a, b) => binary(Math.hypot, a, b, "f"),
  logaddexp: (a, b) => binary((x, y) => (x === y ? x + Math.LN2 : Math.max(x, y) + Math.log1p(Math.exp(-Math.abs(x - y)))), a, b, "f"),
  nextafter: (a, b) => binary(neighbour, a, b, "f"),
  clip: (a, low, high) => np.minimum(np.maximum(a, low), high),
  logical_and: py.and_, logical_or: py.or_, logical_not: py.invert,
  nan_to_num: (a, named) => unary((x) => (Number.isNaN(x) ? named?.values.nan ?? 0 : x), a),
  where(condition, a, b) {
    if (!(condition instanceof Nd) && !(a instanceof Nd) && !(b instanceof Nd)) return py.truth(condition) ? a : b;
    const kind = resultKind(a, b), [c, x, y] = [condition, a, b].map(toNd), shape = broadcastShape(c.shape, x.shape, y.shape);
    const [chosen, yes, no] = [c, x, y].map((part) => flat(broadcastTo(part, shape))), out = made(shape, kind);
    for (let k = 0; k < chosen.length; k++) out.data[k] = chosen[k] ? yes[k] : no[k];
    return out;
  },
  array_equal(a, b, named) {
    const same = named?.values.equal_nan ? (x, y) => x === y || (Number.isNaN(x) && Number.isNaN(y)) : (x, y) => x === y;
    return String(a.shape) === String(b.shape) && flat(a).every((x, k) => same(x, flat(b)[k]));
  },
  isin: (a, list) => {
    const known = new Set(list instanceof Nd ? flat(list) : list);
    return a instanceof Texts ? truths(a.texts.map((x) => known.has(x))) : unary((x) => known.has(x), a, "b");
  },
});

function truths(list) { return new Nd(Float64Array.from(list, Number), [list.length], "b"); }

const bits = new DataView(new ArrayBuffer(8));
function neighbour(from, to) {
  if (from === to || Number.isNaN(from) || Number.isNaN(to)) return to;
  if (from === 0) return to > 0 ? Number.MIN_VALUE : -Number.MIN_VALUE;
  bits.setFloat64(0, from);
  bits.setBigInt64(0, bits.getBigInt64(0) + ((from > 0) === (to > from) ? 1n : -1n));
  return bits.getFloat64(0);
}

// --- along axes

function alongAxes(a, axis) { // the array with the axes that go moved last: [outer shape, rows, their length]
  const axes = (axis === undefined || axis === null ? py.range(a.ndim) : listed(axis)).map((k) => (k < 0 ? k + a.ndim : k));
  const kept = py.range(a.ndim).filter((k) => !axes.includes(k));
  const moved = axes.length === a.ndim ? a : np.transpose(a, [...kept, ...axes]);
  const length = axes.reduce((product, k) => product * a.shape[k], 1);
  return { axes, shape: kept.map((k) => a.shape[k]), values: flat(moved), length };
}

function reduction(f, kind) {
  return (a, ...given) => {
    const named = options(given, ["axis", "dtype", "out", "keepdims", "ddof", "initial"]);
    const array = toNd(a), { axes, shape, values, length } = alongAxes(array, named.axis);
    const out = made(shape, kind ?? array.kind);
    for (let k = 0; k < out.data.length; k++) out.data[k] = +f(values.subarray(k * length, (k + 1) * length), named);
    if (named.keepdims) return np.reshape(out, array.shape.map((n, k) => (axes.includes(k) ? 1 : n)));
    return shape.length ? out : scalarOf(out.data[0], out.kind);
  };
}

function total(row) { // pairwise, as numpy adds
  const n = row.length;
  if (n <= 128) {
    if (n < 8) { let sum = 0; for (let k = 0; k < n; k++) sum += row[k]; return sum; }
    const part = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => row[k]);
    let k = 8;
    for (; k + 8 <= n; k += 8) for (let j = 0; j < 8; j++) part[j] += row[k + j];
    let sum = part[0] + part[1] + (part[2] + part[3]) + (part[4] + part[5] + (part[6] + part[7]));
    for (; k < n; k++) sum += row[k];
    return sum;
  }
  let half = Math.floor(n / 2);
  half -= half % 8;
  return total(row.subarray(0, half)) + total(row.subarray(half));
}

function variance(row, ddof = 0) {
  const mean = total(row) / row.length;
  return total(row.map((x) => (x - mean) * (x - mean))) / (row.length - ddof);
}

function median(row) {
  if (row.some(Number.isNaN) || !row.length) return NaN;
  const sorted = row.slice().sort(), half = row.length >> 1;
  return row.length % 2 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}

function best(better) { // the place of the first best value, of the first NaN if there is one
  return (row) => {
    let at = 0;
    for (let k = 1; k < row.length && !Number.isNaN(row[at]); k++) if (better(row[k], row[at]) || Number.isNaN(row[k])) at = k;
    return at;
  };
}

const reductions = {
  sum: [total, null], mean: [(row) => total(row) / row.length, "f"], prod: [(row) => row.reduce((x, y) => x * y, 1), null],
  max: [(row) => row.reduce((x, y) => Math.max(x, y), -Infinity), null],
  min: [(row) => row.reduce((x, y) => Math.min(x, y), Infinity), null],
  any: [(row) => row.some((x) => x !== 0), "b"], all: [(row) => row.every((x) => x !== 0), "b"],
  var: [(row, named) => variance(row, named.ddof), "f"], std: [(row, named) => Math.sqrt(variance(row, named.ddof)), "f"],
  median: [median, "f"], argmax: [best((x, y) => x > y), "i"], argmin: [best((x, y) => x < y), "i"],
  count_nonzero: [(row) => row.reduce((n, x) => n + (x !== 0), 0), "i"],
  nanmedian: [(row) => median(row.filter((x) => !Number.isNaN(x))), "f"],
  nanmax: [(row) => row.reduce((x, y) => (y > x || Number.isNaN(x) ? y : x), NaN), "f"],
};
for (const [name, [f, kind]] of Object.entries(reductions)) np[name] = reduction(f, kind);
const plainSum = np.sum;
np.sum = (a, ...given) => plainSum(a instanceof Nd && a.kind === "b" ? new Nd(a.data, a.shape, "i", a.strides, a.offset) : a, ...given);
np.nanargmax = (a) => best((x, y) => x > y)(flat(a).map((x) => (Number.isNaN(x) ? -Infinity : x)));

Object.assign(np, {
  cumsum(a) {
    const out = flat(a).slice();
    for (let k = 1; k < out.length; k++) out[k] += out[k - 1];
    return new Nd(out, [out.length], a.kind === "b" ? "i" : a.kind);
  },
  diff(a, ...given) {
    const { axis = -1, append } = options(given, ["n", "axis", "prepend", "append"]);
    if (append !== undefined) a = np.append(a, append);
    const at = axis < 0 ? axis + a.ndim : axis, whole = py.range(a.ndim).map(() => new Slice(null, null));
    const part = (slice) => indexNd(a, whole.map((one, k) => (k === at ? slice : one)));
    return py.sub(part(new Slice(1, null)), part(new Slice(null, -1)));
  },
  diagonal(a, ...given) { // a view of it, as the last axis
    const { axis1 = 0, axis2 = 1 } = options(given, ["offset", "axis1", "axis2"]), kept = py.range(a.ndim).filter((k) => k !== axis1 && k !== axis2);
    const of = (list, own) => [...kept.map((k) => list[k]), own];
    return new Nd(a.data, of(a.shape, Math.min(a.shape[axis1], a.shape[axis2])), a.kind, of(a.strides, a.strides[axis1] + a.strides[axis2]), a.offset);
  },
  trace: (a, ...given) => np.sum(np.diagonal(a, ...given), kw({ axis: -1 })),
  quantile(a, levels, ...given) {
    const { axis } = options(given, ["axis"]), { shape, values, length } = alongAxes(toNd(a), axis);
    const wanted = levels instanceof Nd || Array.isArray(levels) ? [...levels] : [levels];
    const out = made([wanted.length, sizeOf(shape)]), n = sizeOf(shape);
    for (let k = 0; k < n; k++) {
      const row = values.slice(k * length, (k + 1) * length).sort();
      wanted.forEach((level, j) => {
        const at = level * (length - 1), low = Math.floor(at), high = Math.min(low + 1, length - 1), part = at - low;
        const [x, y] = [row[low], row[high]];
        out.data[j * n + k] = Number.isNaN(row[length - 1]) ? NaN : part >= 0.5 ? y - (y - x) * (1 - part) : x + (y - x) * part;
      });
    }
    const shaped = np.reshape(out, [wanted.length, ...shape]);
    return levels instanceof Nd || Array.isArray(levels) ? shaped : getItem(shaped, 0);
  },
});

// --- shapes

Object.assign(np, {
  reshape(a, shape) {
    const array = toNd(a), wanted = listed(shape), open = wanted.indexOf(-1);
    if (open >= 0) wanted[open] = array.size / Math.max(1, wanted.reduce((product, n, k) => (k === open ? product : product * n), 1));
    if (sizeOf(wanted) !== array.size) throw new ValueError(`no array of shape ${array.shape} has the shape ${shape}`);
    return isContiguous(array) ? new Nd(array.data, wanted, array.kind, null, array.offset) : new Nd(flat(array), wanted, array.kind);
  },
  transpose(a, axes) {
    const order = axes && axes.length ? axes : py.range(a.ndim).reverse();
    return new Nd(a.data, order.map((k) => a.shape[k]), a.kind, order.map((k) => a.strides[k]), a.offset);
  },
  swapaxes(a, one, other) {
    const order = py.range(a.ndim), [x, y] = [one, other].map((k) => (k < 0 ? k + a.ndim : k));
    [order[x], order[y]] = [order[y], order[x]];
    return np.transpose(a, order);
  },
  broadcast_to: (a, shape) => broadcastTo(toNd(a), listed(shape)),
  broadcast_arrays(...given) {
    const arrays = given.map(toNd), shape = broadcastShape(...arrays.map((a) => a.shape));
    return arrays.map((a) => broadcastTo(a, shape));
  },
  concatenate(list, ...given) {
    const { axis = 0 } = options(given, ["axis"]), arrays = [...list].map(toNd);
    const at = axis < 0 ? axis + arrays[0].ndim : axis, shape = arrays[0].shape.slice();
    shape[at] = arrays.reduce((sum, a) => sum + a.shape[at], 0);
    const out = made(shape, arrays.every((a) => a.kind === arrays[0].kind) ? arrays[0].kind : "f");
    const whole = py.range(shape.length).map(() => new Slice(null, null));
    let start = 0;
    for (const a of arrays) {
      assignNd(out, whole.map((one, k) => (k === at ? new Slice(start, start + a.shape[at]) : one)), a);
      start += a.shape[at];
    }
    return out;
  },
  stack(list, ...given) {
    const { axis = 0 } = options(given, ["axis"]), arrays = [...list].map(toNd), at = axis < 0 ? axis + arrays[0].ndim + 1 : axis;
    const widened = arrays.map((a) => np.reshape(a, [...a.shape.slice(0, at), 1, ...a.shape.slice(at)]));
    return np.concatenate(widened, kw({ axis: at }));
  },
  vstack: (list) => np.concatenate([...list].map(np.atleast_2d)),
  hstack: (list) => np.concatenate([...list], kw({ axis: toNd([...list][0]).ndim > 1 ? 1 : 0 })),
  dstack: (list) => np.concatenate([...list].map((a) => (a.ndim < 3 ? np.reshape(a, [...a.shape, 1]) : a)), kw({ axis: 2 })),
  column_stack: (list) => np.concatenate([...list].map((a) => (a.ndim < 2 ? np.reshape(a, [-1, 1]) : a)), kw({ axis: 1 })),
  append: (a, value) => np.concatenate([np.reshape(toNd(a), [-1]), np.reshape(toNd(value), [-1])]),
  repeat(a, times, ...given) {
    const { axis } = options(given, ["axis"]), array = axis === undefined ? np.reshape(toNd(a), [-1]) : a;
    const counts = times instanceof Nd ? flat(times) : null, at = axis ?? 0;
    const places = py.range(array.shape[at]).flatMap((k) => new Array(counts ? counts[k] : times).fill(k));
    return indexNd(array, py.range(array.ndim).map((k) => (k === at ? np.array(places) : new Slice(null, null))));
  },
  roll(a, by) { const n = a.size, from = flat(a); return new Nd(from.map((_, k) => from[(((k - by) % n) + n) % n]), [n], a.kind); },
  pad(a, width, named) {
    if (named?.values.mode !== "wrap") throw new Error("arrays are padded around the cycle alone");
    return np.concatenate([indexNd(a, [new Slice(-width, null)]), a, indexNd(a, [new Slice(null, width)])]);
  },
  delete(a, at, named) {
    const axis = named.values.axis, places = py.range(a.shape[axis]).filter((k) => k !== at);
    return indexNd(a, py.range(a.ndim).map((k) => (k === axis ? np.array(places) : new Slice(null, null))));
  },
});

// --- places

Object.assign(np, {
  flatnonzero(a) {
    const out = [];
    flat(toNd(a)).forEach((x, k) => { if (x !== 0) out.push(k); });
    return new Nd(Float64Array.from(out), [out.length], "i");
  },
  argsort(a) {
    const from = flat(a), places = py.range(from.length).sort((x, y) => {
      if (Number.isNaN(from[x]) || Number.isNaN(from[y])) return Number.isNaN(from[x]) - Number.isNaN(from[y]) || x - y;
      return from[x] - from[y] || x - y;
    });
    return new Nd(Float64Array.from(places), [places.length], "i");
  },
  sort: (a) => new Nd(flat(a).slice().sort(), a.shape.slice(), a.kind),
  unique(a, named) {
    const values = [...new Set(flat(a))].sort((x, y) => x - y), out = new Nd(Float64Array.from(values), [values.length], a.kind);
    const { return_index: index, return_inverse: inverse } = named?.values ?? {};
    if (!index && !inverse) return out;
    const place = new Map(values.map((x, k) => [x, k])), of = flat(a).map((x) => place.get(x));
    const first = values.map(() => NaN), places = (list) => new Nd(Float64Array.from(list), [list.length], "i");
    of.forEach((at, k) => { if (Number.isNaN(first[at])) first[at] = k; });
    return [out, ...(index ? [places(first)] : []), ...(inverse ? [places(of)] : [])];
  },
  searchsorted(a, wanted, ...given) {
    const { side = "left" } = options(given, ["side"]), from = flat(a);
    return unary((x) => {
      let [low, high] = [0, from.length];
      while (low < high) {
        const middle = (low + high) >> 1;
        if (side === "left" ? from[middle] < x : from[middle] <= x) low = middle + 1;
        else high = middle;
      }
      return low;
    }, wanted, "i");
  },
  bincount(a, named) {
    const from = flat(a), weights = named?.values.weights, n = Math.max(named?.values.minlength ?? 0, from.reduce((x, y) => Math.max(x, y + 1), 0));
    const out = made([n], weights ? "f" : "i"), by = weights ? flat(weights) : null;
    from.forEach((at, k) => { out.data[at] += by ? by[k] : 1; });
    return out;
  },
  interp(wanted, at, values) {
    const x = flat(at), y = flat(values), n = x.length;
    return unary((v) => {
      if (v <= x[0]) return y[0];
      if (v >= x[n - 1]) return y[n - 1];
      const k = py.min(n - 2, np.searchsorted(at, v, "right") - 1);
      return y[k] + ((y[k + 1] - y[k]) / (x[k + 1] - x[k])) * (v - x[k]);
    }, wanted);
  },
});
np.add.at = (a, index, value) => {
  const places = index.map((part) => flat(toNd(part)));
  for (let k = 0; k < places[0].length; k++) a.data[places.reduce((o, list, axis) => o + (list[k] < 0 ? list[k] + a.shape[axis] : list[k]) * a.strides[axis], a.offset)] += value;
};

class Texts { // an array of texts of one axis
  constructor(texts) { this.texts = texts; }
  get shape() { return [this.texts.length]; }
  get size() { return this.texts.length; }
  get length() { return this.texts.length; }
  tolist() { return this.texts.slice(); }
  [Symbol.iterator]() { return this.texts[Symbol.iterator](); }
  getItem_(at) {
    if (typeof at === "number") return this.texts[at];
    const places = at.kind === "b" ? np.flatnonzero(at) : at;
    return new Texts(Array.from(flat(places), (k) => this.texts[k]));
  }
}
function textsEqual(a, b) { return truths(a.texts.map((x, k) => x === (b.texts ? b.texts[k] : b))); }

for (const name of ["sum", "mean", "max", "min", "any", "all", "std", "var", "argmax", "argmin", "prod", "cumsum", "argsort", "repeat", "swapaxes", "clip"]) {
  method(Nd.prototype, { [name](...given) { return np[name](this, ...given); } });
}
