// What Python does and JavaScript does otherwise: operators on arrays, truth, indices, calls by name, formats.

const ELLIPSIS = Symbol("...");

class Keywords { constructor(values) { this.values = values; } }
class PythonError extends Error {}
class ValueError extends PythonError {}
class KeyError extends PythonError {}
class LinAlgError extends PythonError {}

const both = (a, b) => typeof a === "number" && typeof b === "number";

// --- operators

const py = {
  add(a, b) {
    if (both(a, b) || typeof a === "string") return a + b;
    return Array.isArray(a) && Array.isArray(b) ? [...a, ...b] : binary((x, y) => x + y, a, b, resultKind(a, b));
  },
  sub: (a, b) => (both(a, b) ? a - b : binary((x, y) => x - y, a, b, resultKind(a, b))),
  mul(a, b) {
    if (both(a, b)) return a * b;
    if (typeof a === "string") return a.repeat(b);
    if (Array.isArray(a) && typeof b === "number") return [].concat(...new Array(b).fill(a));
    return binary((x, y) => x * y, a, b, resultKind(a, b));
  },
  div: (a, b) => (both(a, b) ? a / b : binary((x, y) => x / y, a, b, "f")),
  floordiv: (a, b) => (both(a, b) ? Math.floor(a / b) : binary((x, y) => Math.floor(x / y), a, b, resultKind(a, b))),
  mod(a, b) {
    const f = (x, y) => { const rest = x % y; return rest !== 0 && rest < 0 !== y < 0 ? rest + y : rest; };
    return both(a, b) ? f(a, b) : binary(f, a, b, resultKind(a, b));
  },
  pow(a, b) {
    const f = (x, y) => {
      if (y === 2) return x * x;
      return y === 0.5 ? Math.sqrt(x) : y === 1 ? x : y === 3 ? x * x * x : y === -1 ? 1 / x : Math.pow(x, y);
    };
    return both(a, b) ? f(a, b) : binary(f, a, b, resultKind(a, b));
  },
  matmul: (a, b) => np.matmul(a, b),
  or_(a, b) {
    if (a instanceof Map) return new Map([...a, ...b]);
    if (a instanceof Set) return new Set([...a, ...b]);
    return binary((x, y) => x || y, a, b, "b");
  },
  and_: (a, b) => (a instanceof Set ? new Set([...a].filter((x) => b.has(x))) : binary((x, y) => x && y, a, b, "b")),
  xor: (a, b) => binary((x, y) => x !== y, a, b, "b"),
  neg: (a) => (typeof a === "number" ? -a : unary((x) => -x, a, kindOf(a) === "i" ? "i" : "f")),
  invert: (a) => unary((x) => x === 0, a, "b"),
  lt: (a, b) => (both(a, b) ? a < b : binary((x, y) => x < y, a, b, "b")),
  le: (a, b) => (both(a, b) ? a <= b : binary((x, y) => x <= y, a, b, "b")),
  gt: (a, b) => (both(a, b) ? a > b : binary((x, y) => x > y, a, b, "b")),
  ge: (a, b) => (both(a, b) ? a >= b : binary((x, y) => x >= y, a, b, "b")),
  eq(a, b) {
    if (a instanceof Nd || b instanceof Nd) return compareText(a, b) ?? binary((x, y) => x === y, a, b, "b");
    if (Array.isArray(a) && Array.isArray(b)) return a.length === b.length && a.every((x, k) => py.eq(x, b[k]));
    if (a && a.texts) return textsEqual(a, b);
    return a === b || (typeof a === "boolean" && +a === b);
  },
  ne(a, b) {
    const same = py.eq(a, b);
    return typeof same === "boolean" ? !same : py.invert(same);
  },
  // in place, as Python has it for arrays: every view of them sees it
  inplace(op, a, b) {
    if (!(a instanceof Nd)) return op(a, b);
    assignNd(a, [ELLIPSIS], op(a, b));
    return a;
  },
  contains(inside, value) {
    if (inside instanceof Map || inside instanceof Set) return inside.has(value);
    if (typeof inside === "string") return inside.includes(value);
    if (inside && inside.has_) return inside.has_(value);
    return Array.from(inside).some((x) => py.eq(x, value) === true);
  },
  truth(a) {
    if (a === null || a === undefined) return false;
    if (typeof a === "object") {
      if (a instanceof Nd) {
        if (a.size !== 1) throw new ValueError("the truth of an array of several values is ambiguous");
        return flat(a)[0] !== 0;
      }
      if (Array.isArray(a)) return a.length > 0;
      if (a instanceof Map || a instanceof Set) return a.size > 0;
    }
    return Boolean(a);
  },
  slice: (start, stop, step) => new Slice(start, stop, step),
  getattr(a, name) { return a[name]; },
};

function resultKind(a, b) {
  const x = kindOf(a), y = kindOf(b);
  if (x === "f" || y === "f") return "f";
  // a whole number that JavaScript holds may be a float of Python; an array knows what it is
  if (a instanceof Nd && b instanceof Nd) return "i";
  return a instanceof Nd ? (x === "i" ? "i" : y) : y === "i" ? "i" : x;
}

// --- indices

function getItem(a, ...index) {
  if (a instanceof Nd) return indexNd(a, index);
  const key = index[0];
  if (a instanceof Map) {
    if (!a.has(key)) throw new KeyError(String(key));
    return a.get(key);
  }
  if (Array.isArray(a) || typeof a === "string") {
    if (key instanceof Slice) {
      const { start, step, count } = key.within(a.length), parts = Array.from({ length: count }, (_, k) => a[start + k * step]);
      return typeof a === "string" ? parts.join("") : parts;
    }
    const at = key < 0 ? key + a.length : +key;
    if (!(at >= 0 && at < a.length)) throw new KeyError(`index ${key} is out of range`);
    return a[at];
  }
  if (a && a.getItem_) return a.getItem_(...index);
  if (a && a[Symbol.iterator]) return getItem([...a], ...index);
  throw new Error("this has no entries");
}

function setItem(a, value, ...index) {
  if (a instanceof Nd) assignNd(a, index, value);
  else if (a instanceof Map) a.set(index[0], value);
  else a[index[0] < 0 ? index[0] + a.length : index[0]] = value;
}

function unpacked(value, count, starred = -1) { // `starred`: place of the name that takes what is left
  const parts = Array.isArray(value) ? value : each(value);
  if (starred < 0) {
    if (parts.length !== count) throw new ValueError(`expected ${count} values to unpack, got ${parts.length}`);
    return parts;
  }
  const after = count - 1 - starred;
  return [...parts.slice(0, starred), parts.slice(starred, parts.length - after), ...parts.slice(parts.length - after)];
}

function call(f, given, named = null) { // of what is not known when it is translated
  if (named !== null) {
    const names = f.parameters;
    if (!names) given = [...given, new Keywords(named instanceof Map ? Object.fromEntries(named) : named)];
    else {
      given = given.slice();
      for (const [name, value] of named instanceof Map ? named : Object.entries(named)) {
        const place = names.indexOf(name);
        if (place < 0) throw new Error(`${f.name} takes no ${name}`);
        given[place] = value;
      }
    }
  }
  return f.isClass ? new f(...given) : f(...given);
}

// The named values at the end of the arguments of a function of the library, and the others by place.
function options(given, names) {
  const last = given[given.length - 1], out = {};
  const places = last instanceof Keywords ? given.slice(0, -1) : given;
  names.forEach((name, k) => { if (k < places.length) out[name] = places[k]; });
  if (last instanceof Keywords) {
    for (const name of Object.keys(last.values)) {
      if (!names.includes(name)) throw new Error(`no such argument: ${name}`);
    }
    Object.assign(out, last.values);
  }
  return out;
}

const kw = (values) => new Keywords(values);

// --- builtins

function oneByOne(work, items) { for (const item of items) work(item); } // of `in_threads`: a page has one
function gatedAlone() { throw new Error("the page has gated recordings alone"); } // of what pushes ask for
function each(a) { return a instanceof Map ? [...a.keys()] : [...a]; } // of a dictionary its keys, as Python goes through it

Object.assign(py, {
  len: (a) => (a instanceof Map || a instanceof Set ? a.size : a.len_ ? a.len_() : a.length ?? [...a].length),
  range(a, b, step = 1) {
    const [start, stop] = b === undefined ? [0, a] : [a, b], out = [];
    for (let k = start; step > 0 ? k < stop : k > stop; k += step) out.push(k);
    return out;
  },
  zip(...given) {
    const lists = given.filter((part) => !(part instanceof Keywords)).map(each);
    return Array.from({ length: Math.min(...lists.map((list) => list.length)) }, (_, k) => lists.map((list) => list[k]));
  },
  enumerate: (a, start = 0) => each(a).map((value, k) => [k + (start instanceof Keywords ? start.values.start : start), value]),
  list: (a = []) => each(a),
  tuple: (a = []) => each(a),
  set: (a = []) => new Set(each(a)),
  dict(a, named) {
    const out = new Map(a instanceof Keywords ? Object.entries(a.values) : a ?? []);
    if (named instanceof Keywords) for (const [name, value] of Object.entries(named.values)) out.set(name, value);
    return out;
  },
  fromkeys: (keys, value = null) => new Map(each(keys).map((key) => [key, value])),
  float: (a) => (a instanceof Nd ? flat(a)[0] : typeof a === "string" ? parseNumber(a) : +a),
  int: (a) => Math.trunc(a instanceof Nd ? flat(a)[0] : +a),
  bool: (a) => py.truth(a),
  str: (a) => text(a),
  repr: (a) => (typeof a === "string" ? quoted(a) : text(a)),
  abs: (a) => (typeof a === "number" ? Math.abs(a) : unary(Math.abs, a, kindOf(a))),
  round(a, digits) {
    if (digits !== undefined) return Number(fixed(a, digits));
    const low = Math.floor(a), rest = a - low;
    return rest === 0.5 ? low + (low % 2 === 0 ? 0 : 1) : Math.round(a);
  },
  sum: (a, start = 0) => each(a).reduce(py.add, start),
  any: (a) => each(a).some(py.truth),
  all: (a) => each(a).every(py.truth),
  max: (...given) => extreme(given, (a, b) => a > b),
  min: (...given) => extreme(given, (a, b) => a < b),
  sorted(a, named) {
    const key = named instanceof Keywords ? named.values.key ?? ((x) => x) : (x) => x;
    const out = each(a).sort((x, y) => (key(x) < key(y) ? -1 : key(x) > key(y) ? 1 : 0));
    return named instanceof Keywords && named.values.reverse ? out.reverse() : out;
  },
  next(a, otherwise) {
    for (const value of each(a)) return value;
    if (otherwise === undefined) throw new ValueError("nothing is left");
    return otherwise;
  },
  isinstance(a, type) {
    if (Array.isArray(type)) return type.some((one) => py.isinstance(a, one));
    return type === py.tuple || type === py.list ? Array.isArray(a) : type === py.str ? typeof a === "string" : a instanceof type;
  },
  type: (a) => a.constructor,
  vars: (a) => new Map(Object.entries(a)),
  replace: (a, named) => call(a.constructor, a.constructor.parameters.map((name) => (
    Object.prototype.hasOwnProperty.call(named.values, name) ? named.values[name] : a[name]))),
  fields: (a) => (a.parameters ?? a.constructor.parameters).map((name) => ({ name })),
  map: (f, a) => each(a).map((x) => call(f, [x])),
  cached(f) { // by the values of what it is given: plain ones, settings, bytes
    const known = new Map();
    const out = (...given) => {
      const key = given.map((part) => (part instanceof Bytes ? String(part) : JSON.stringify(part))).join("|");
      if (!known.has(key)) known.set(key, f(...given));
      return known.get(key);
    };
    out.parameters = f.parameters;
    return out;
  },
});

py.dict.fromkeys = py.fromkeys;

function extreme(given, better) {
  const named = given[given.length - 1] instanceof Keywords ? given.pop().values : {};
  const values = given.length === 1 ? each(given[0]) : given, key = named.key ?? ((x) => x);
  if (!values.length) {
    if ("default" in named) return named.default;
    throw new ValueError("of nothing there is no largest and no smallest value");
  }
  return values.reduce((best, value) => (better(key(value), key(best)) ? value : best));
}

// Methods of texts, lists and dictionaries by Python's names.
const method = (prototype, methods) => Object.entries(methods).forEach(([name, value]) => (
  Object.defineProperty(prototype, name, { value, writable: true, enumerable: false })));
method(Map.prototype, {
  items() { return [...this]; },
  found(key, otherwise = null) { return this.has(key) ? this.get(key) : otherwise; },
  pop(key, otherwise) {
    const value = this.found(key, otherwise);
    this.delete(key);
    return value;
  },
  update(other) { for (const [key, value] of other) this.set(key, value); },
});
method(Array.prototype, {
  append(value) { this.push(value); },
  extend(values) { this.push(...values); },
  index(value) { return this.findIndex((x) => py.eq(x, value) === true); },
  count(value) { return this.filter((x) => py.eq(x, value) === true).length; },
});
method(String.prototype, {
  strip(signs) {
    if (signs === undefined) return this.trim();
    let [start, end] = [0, this.length];
    while (start < end && signs.includes(this[start])) start++;
    while (end > start && signs.includes(this[end - 1])) end--;
    return this.slice(start, end);
  },
  lower() { return this.toLowerCase(); },
  upper() { return this.toUpperCase(); },
  startswith(beginning) { return Array.isArray(beginning) ? beginning.some((one) => this.startsWith(one)) : this.startsWith(beginning); },
  endswith(end) { return this.endsWith(end); },
  removeprefix(beginning) { return this.startsWith(beginning) ? this.slice(beginning.length) : String(this); },
  find(part) { return this.indexOf(part); },
  joined(parts) { return each(parts).map(text).join(this); },
});

// --- texts

function quoted(value) {
  const sign = value.includes("'") && !value.includes('"') ? '"' : "'";
  const escaped = value.replaceAll("\\", "\\\\").replaceAll("\n", "\\n").replaceAll("\t", "\\t").replaceAll("\r", "\\r");
  return sign + escaped.replaceAll(sign, `\\${sign}`) + sign;
}

function text(value) {
  if (value === null || value === undefined) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  if (Array.isArray(value)) return `[${value.map(py.repr).join(", ")}]`;
  if (typeof value === "number") return Number.isNaN(value) ? "nan" : String(value).replace("Infinity", "inf");
  return value.str_ ? value.str_() : String(value);
}

// Digits behind the point, halves to even in the exact decimal value as Python has it; toFixed rounds them up.
function fixed(value, digits) {
  if (!Number.isFinite(value)) return text(value);
  const shown = Math.abs(value) < 1e21 ? value.toFixed(digits) : BigInt(value).toString();
  const exact = exactHalf(value, digits);
  return exact ?? shown;
}

function exactHalf(value, digits) {
  const scaled = Math.abs(value) * 10 ** digits, low = Math.floor(scaled);
  // halves are exact in doubles where few binary places suffice
  if (scaled - low !== 0.5 || digits > 3 || (Math.abs(value) * 2 ** (digits + 1)) % 1 !== 0) return null;
  return `${value < 0 ? "-" : ""}${((low + (low % 2)) / 10 ** digits).toFixed(digits)}`;
}

function general(value, digits) { // the format "g"
  if (!Number.isFinite(value)) return text(value);
  if (value === 0) return Object.is(value, -0) ? "-0" : "0";
  const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  const power = Number(exponent);
  if (power < -4 || power >= digits) {
    const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
    return `${short}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
  }
  const shown = value.toFixed(digits - 1 - power);
  return shown.includes(".") ? shown.replace(/\.?0+$/, "") : shown;
}

function format(value, spec) {
  if (!spec) return text(value);
  const parts = /^(?:(.)?([<>^]))?(,)?(\d+)?(,)?(?:\.(\d+))?([gfeds%])?$/.exec(spec);
  if (!parts) throw new Error(`no such format: ${spec}`);
  const [, fill = " ", align, , width, comma, digits, type] = parts;
  const places = digits === undefined ? 6 : Number(digits);
  let shown;
  if (type === "g" || (digits !== undefined && type === undefined)) shown = general(value, places || 1);
  else if (type === "f") shown = fixed(value, places);
  else if (type === "e") shown = value.toExponential(places).replace(/e([+-])(\d)$/, "e$10$2");
  else if (type === "%") shown = `${fixed(value * 100, places)}%`;
  else shown = text(value);
  if (comma || parts[3]) shown = shown.replace(/\B(?=(\d{3})+(?!\d))/g, ",");
  if (!width) return shown;
  return (align ?? (typeof value === "string" ? "<" : ">")) === ">" ? shown.padStart(width, fill) : shown.padEnd(width, fill);
}

function parseNumber(written) {
  const trimmed = String(written).trim().replace(/(?<=\d)_(?=\d)/g, "");
  if (/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(trimmed)) return Number(trimmed);
  const word = trimmed.toLowerCase().replace(/^\+/, "");
  if (word === "nan") return NaN;
  if (word === "inf" || word === "infinity") return Infinity;
  if (word === "-inf" || word === "-infinity") return -Infinity;
  throw new ValueError(`could not convert string to float: ${quoted(String(written))}`);
}

function compareText() { return null; }
