// Arrays as numpy has them: a buffer of doubles with a shape and strides. Basic indices give views, others copies.
// `kind` says what the numbers stand for: "f" floats, "i" whole numbers, "b" truth values (0 and 1).

class Nd {
  constructor(data, shape, kind = "f", strides = null, offset = 0) {
    this.data = data;
    this.shape = shape;
    this.kind = kind;
    this.strides = strides ?? stridesOf(shape);
    this.offset = offset;
  }
  get ndim() { return this.shape.length; }
  get size() { return sizeOf(this.shape); }
  get length() { return this.shape[0]; }
  get T() { return np.transpose(this); }
  get flags() { return {}; } // nothing is kept from being written here
  *[Symbol.iterator]() { for (let i = 0; i < this.shape[0]; i++) yield getItem(this, i); }
  copy() { return new Nd(flat(this).slice(), this.shape.slice(), this.kind); }
  reshape(...shape) { return np.reshape(this, shape.length === 1 && Array.isArray(shape[0]) ? shape[0] : shape); }
  transpose(...axes) { return np.transpose(this, axes.length === 1 && Array.isArray(axes[0]) ? axes[0] : axes); }
  astype(type) { return np.asarray(this, type); }
  tolist() { return Array.from(this, (row) => (row instanceof Nd ? row.tolist() : row)); }
  tobytes() { return new Bytes(flat(this).slice()); }
  item() { return flat(this)[0]; }
  nonzero() { return [np.flatnonzero(this)]; }
}

class Bytes { // what np.frombuffer takes back; equal contents are equal keys of a cache
  constructor(values) { this.values = values; }
  toString() { return this.values.join(); }
}

class Slice {
  constructor(start, stop, step) { this.start = start; this.stop = stop; this.step = step ?? 1; }
  within(length) {
    const bound = (value, otherwise) => {
      if (value === null || value === undefined) return otherwise;
      const at = value < 0 ? value + length : value;
      return this.step > 0 ? Math.min(Math.max(at, 0), length) : Math.min(Math.max(at, -1), length - 1);
    };
    const [start, stop] = this.step > 0
      ? [bound(this.start, 0), bound(this.stop, length)] : [bound(this.start, length - 1), bound(this.stop, -1)];
    return { start, step: this.step, count: Math.max(0, Math.ceil((stop - start) / this.step)) };
  }
}

function sizeOf(shape) {
  let size = 1;
  for (const length of shape) size *= length;
  return size;
}

function stridesOf(shape) {
  const strides = new Array(shape.length);
  let step = 1;
  for (let axis = shape.length - 1; axis >= 0; axis--) { strides[axis] = step; step *= shape[axis]; }
  return strides;
}

function isContiguous(a) {
  let step = 1;
  for (let axis = a.shape.length - 1; axis >= 0; axis--) {
    if (a.shape[axis] !== 1 && a.strides[axis] !== step) return false;
    step *= a.shape[axis];
  }
  return true;
}

// Where each element lies in the buffer, in the order of the elements.
function forEachOffset(shape, strides, offset, visit) {
  const ndim = shape.length;
  if (ndim === 0) { visit(offset, 0); return; }
  if (sizeOf(shape) === 0) return;
  const inner = shape[ndim - 1], step = strides[ndim - 1], index = new Array(ndim - 1).fill(0);
  let at = offset, place = 0;
  for (;;) {
    for (let k = 0, o = at; k < inner; k++, o += step) visit(o, place++);
    let axis = ndim - 2;
    for (; axis >= 0; axis--) {
      at += strides[axis];
      if (++index[axis] < shape[axis]) break;
      at -= strides[axis] * shape[axis];
      index[axis] = 0;
    }
    if (axis < 0) return;
  }
}

function flat(a) { // the elements in order; a part of the buffer itself where they lie in order
  if (isContiguous(a)) return a.data.subarray(a.offset, a.offset + a.size);
  const out = new Float64Array(a.size), data = a.data;
  forEachOffset(a.shape, a.strides, a.offset, (o, k) => { out[k] = data[o]; });
  return out;
}

function made(shape, kind = "f") { return new Nd(new Float64Array(sizeOf(shape)), shape, kind); }

function scalarOf(value, kind) { return kind === "b" ? value !== 0 : value; }

function kindOf(value) {
  if (value instanceof Nd) return value.kind;
  return typeof value === "boolean" ? "b" : Number.isInteger(value) ? "i" : "f";
}

function broadcastShape(...shapes) {
  const ndim = Math.max(...shapes.map((shape) => shape.length)), out = new Array(ndim).fill(1);
  for (const shape of shapes) {
    shape.forEach((length, k) => {
      const axis = ndim - shape.length + k;
      if (length !== 1 && out[axis] !== 1 && out[axis] !== length) {
        throw new Error(`shapes ${JSON.stringify(shapes)} cannot be broadcast together`);
      }
      if (length !== 1) out[axis] = length;
    });
  }
  return out;
}

function broadcastTo(a, shape) {
  const extra = shape.length - a.shape.length;
  const strides = shape.map((length, axis) => {
    if (axis < extra) return 0;
    return a.shape[axis - extra] === 1 && length !== 1 ? 0 : a.strides[axis - extra];
  });
  return new Nd(a.data, shape, a.kind, strides, a.offset);
}

function toNd(value) {
  if (value instanceof Nd) return value;
  if (typeof value === "number" || typeof value === "boolean") return new Nd(Float64Array.of(+value), [], kindOf(value));
  return np.array(value);
}

function unary(f, a, kind = null) {
  if (!(a instanceof Nd)) {
    if (typeof a === "number" || typeof a === "boolean") return scalarOf(+f(+a), kind ?? "f");
    a = np.array(a);
  }
  const from = flat(a), out = made(a.shape.slice(), kind ?? "f"), to = out.data;
  for (let k = 0; k < to.length; k++) to[k] = +f(from[k]);
  return out;
}

function binary(f, a, b, kind) {
  a = toNd(a);
  b = toNd(b);
  if (!a.ndim && !b.ndim) return scalarOf(+f(a.data[a.offset], b.data[b.offset]), kind);
  const shape = broadcastShape(a.shape, b.shape), out = made(shape, kind), to = out.data;
  if (!b.ndim) {
    const from = flat(a), y = b.data[b.offset];
    for (let k = 0; k < to.length; k++) to[k] = +f(from[k], y);
  } else if (!a.ndim) {
    const from = flat(b), x = a.data[a.offset];
    for (let k = 0; k < to.length; k++) to[k] = +f(x, from[k]);
  } else {
    const x = flat(broadcastTo(a, shape)), y = flat(broadcastTo(b, shape));
    for (let k = 0; k < to.length; k++) to[k] = +f(x[k], y[k]);
  }
  return out;
}

// --- indexing

function isIndexArray(part) { return part instanceof Nd || Array.isArray(part); }

function expanded(index, ndim) { // with the ellipsis written out, and slices for what is not named
  const parts = index.slice();
  const taken = parts.reduce((sum, part) => {
    if (part === null || part === ELLIPSIS) return sum;
    return sum + (part instanceof Nd && part.kind === "b" ? part.ndim : 1);
  }, 0);
  const rest = new Array(Math.max(0, ndim - taken)).fill(null).map(() => new Slice(null, null));
  const place = parts.indexOf(ELLIPSIS);
  if (place >= 0) parts.splice(place, 1, ...rest);
  else parts.push(...rest);
  return parts;
}

function basicView(a, parts) { // whole numbers, slices and new axes alone
  const shape = [], strides = [];
  let offset = a.offset, axis = 0;
  for (const part of parts) {
    if (part === null) { shape.push(1); strides.push(0); continue; }
    const length = a.shape[axis], stride = a.strides[axis];
    if (part instanceof Slice) {
      const { start, step, count } = part.within(length);
      shape.push(count);
      strides.push(stride * step);
      offset += start * stride;
    } else {
      const at = part < 0 ? part + length : +part;
      if (!(at >= 0 && at < length)) throw new Error(`index ${part} is out of bounds for an axis of ${length}`);
      offset += at * stride;
    }
    axis++;
  }
  return new Nd(a.data, shape, a.kind, strides, offset);
}

// Offsets of an index with arrays in it, and the shape of what it takes: arrays are broadcast together, and
// stand where the first of them does, or first of all if slices part them.
function advanced(a, parts) {
  const axes = []; // one entry an axis of `a`: a list of places, or a slice; new axes are kept apart
  for (const part of parts) {
    if (part instanceof Nd && part.kind === "b") {
      if (part.ndim !== 1) throw new Error("a mask has one axis here");
      axes.push(np.flatnonzero(part));
    } else axes.push(Array.isArray(part) ? np.array(part) : part);
  }
  const isArray = (part) => part instanceof Nd, isTaken = (part) => isArray(part) || typeof part === "number";
  const shared = broadcastShape(...axes.filter(isArray).map((part) => part.shape));
  const first = axes.findIndex(isTaken), last = axes.length - 1 - axes.slice().reverse().findIndex(isTaken);
  const together = axes.slice(first, last + 1).every(isTaken);
  const shape = [], sliced = []; // of the slices: [stride, start, step, count]
  let at = 0, axis = 0, offset = a.offset;
  const lists = [];
  axes.forEach((part, k) => {
    if (k === first && together) { at = shape.length; shape.push(...shared); }
    if (part === null) { shape.push(1); sliced.push([0, 1]); return; }
    const length = a.shape[axis], stride = a.strides[axis];
    if (part instanceof Slice) {
      const { start, step, count } = part.within(length);
      offset += start * stride;
      shape.push(count);
      sliced.push([stride * step, count]);
    } else if (isArray(part)) lists.push([flat(broadcastTo(part, shared)), stride, length]);
    else offset += (part < 0 ? part + length : part) * stride;
    axis++;
  });
  if (!together) shape.unshift(...shared);
  const taken = new Float64Array(sizeOf(shared));
  for (const [places, stride, length] of lists) {
    for (let k = 0; k < taken.length; k++) {
      const place = places[k] < 0 ? places[k] + length : places[k];
      if (!(place >= 0 && place < length)) throw new Error(`index ${places[k]} is out of bounds for an axis of ${length}`);
      taken[k] += place * stride;
    }
  }
  return { shape, sliced, taken, offset, before: together ? at : 0 };
}

function advancedOffsets({ shape, sliced, taken, offset, before }, visit) {
  const lead = sliced.slice(0, before), tail = sliced.slice(before);
  const counts = (parts) => parts.map(([, count]) => count), steps = (parts) => parts.map(([stride]) => stride);
  let place = 0;
  forEachOffset(counts(lead), steps(lead), offset, (outer) => {
    for (let k = 0; k < taken.length; k++) {
      forEachOffset(counts(tail), steps(tail), outer + taken[k], (o) => visit(o, place++));
    }
  });
  return shape;
}

function isWholeMask(index) { return index.length === 1 && index[0] instanceof Nd && index[0].kind === "b" && index[0].ndim > 1; }

function indexNd(a, index) { // `index`: its parts, as Python has them between brackets
  if (isWholeMask(index)) {
    const mask = flat(index[0]), from = flat(a), out = [];
    for (let k = 0; k < mask.length; k++) if (mask[k]) out.push(from[k]);
    return new Nd(Float64Array.from(out), [out.length], a.kind);
  }
  const parts = expanded(index, a.ndim);
  if (!parts.some(isIndexArray)) {
    const view = basicView(a, parts);
    return view.ndim ? view : scalarOf(view.data[view.offset], view.kind);
  }
  const plan = advanced(a, parts), out = made(plan.shape, a.kind), to = out.data, data = a.data;
  advancedOffsets(plan, (o, k) => { to[k] = data[o]; });
  return out;
}

function assignNd(a, index, value) {
  if (isWholeMask(index)) {
    const mask = flat(index[0]), y = toNd(value), from = flat(y);
    let k = 0, place = 0;
    forEachOffset(a.shape, a.strides, a.offset, (o) => { if (mask[k++]) a.data[o] = y.ndim ? from[place++] : from[0]; });
    return;
  }
  const parts = expanded(index, a.ndim);
  if (!parts.some(isIndexArray)) {
    const view = basicView(a, parts), from = flat(broadcastTo(toNd(value), view.shape));
    const whole = from.buffer === view.data.buffer ? from.slice() : from;
    forEachOffset(view.shape, view.strides, view.offset, (o, k) => { a.data[o] = whole[k]; });
    return;
  }
  const plan = advanced(a, parts), from = flat(broadcastTo(squeezed(toNd(value), plan.shape), plan.shape));
  advancedOffsets(plan, (o, k) => { a.data[o] = from[k]; });
}

function squeezed(a, shape) { // leading axes of length one beyond those of the place that it goes to
  while (a.ndim > shape.length && a.shape[0] === 1) a = getItem(a, 0);
  return toNd(a);
}
