// Files that a reader hands over, and what Python's libraries do with their text: csv, re and difflib.

const files = { // by the name under which a reader handed them over
  contents: new Map(),
  read_bytes(path) {
    if (!files.contents.has(path)) throw new Error(`no file was given as ${path}`);
    return new Content(files.contents.get(path));
  },
};

class UnicodeDecodeError extends ValueError {
  constructor(start) { super(`byte ${start} is no UTF-8`); this.start = start; }
}

class Content { // bytes
  constructor(values) { this.values = Uint8Array.from(values); }
  startswith(beginnings) {
    return (Array.isArray(beginnings) ? beginnings : [beginnings]).some(({ values }) => values.every((x, k) => this.values[k] === x));
  }
  decode() { // UTF-8, a mark at the beginning left out
    try {
      return new TextDecoder("utf-8", { fatal: true }).decode(this.values);
    } catch {
      throw new UnicodeDecodeError(firstWrongByte(this.values));
    }
  }
}

function firstWrongByte(values) {
  const strict = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });
  for (let k = 0; k < values.length;) {
    const lead = values[k], size = lead < 0x80 ? 1 : lead < 0xc2 ? 0 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : lead < 0xf5 ? 4 : 0;
    try {
      if (!size || k + size > values.length) return k;
      strict.decode(values.subarray(k, k + size));
    } catch {
      return k;
    }
    k += size;
  }
  return values.length;
}

// Names of columns stand in a line of their own: the page takes this project's own form alone.
function asWritten(text) { return text; }

// What of a name counts: letters in one case, numbers without zeros before them, signs between numbers.
function spelling(name) {
  const sign = "[^\\p{L}\\p{N}]+";
  const lowered = name.normalize("NFKC").toLowerCase();
  const without = lowered.replace(new RegExp(`(?<![0-9])${sign}|${sign}(?![0-9])`, "gu"), "");
  return without.replace(new RegExp(sign, "gu"), "-").replace(/(?<![0-9])0+(?=[0-9])/g, "") || name;
}

// Signs that cannot be printed as Python's escapes; line breaks and tabulators stay.
function printable(text) {
  return text.replace(/(?![\n\t ])[\p{C}\p{Z}]/gu, (sign) => {
    const hex = sign.codePointAt(0).toString(16);
    if (sign === "\r") return "\\r";
    if (hex.length < 3) return `\\x${hex.padStart(2, "0")}`;
    return hex.length < 5 ? `\\u${hex.padStart(4, "0")}` : `\\U${hex.padStart(8, "0")}`;
  });
}

// A text without the signs that cannot be seen, and what these are.
function visible(text) { return text.replace(/(?!\s)[\p{C}\p{Z}]/gu, ""); }
function hiddenSigns(text) {
  const codes = new Set([...text.matchAll(/(?! )[\p{C}\p{Z}]/gu)].map(([sign]) => `U+${sign.codePointAt(0).toString(16).toUpperCase().padStart(4, "0")}`));
  return codes.size ? ` (with ${[...codes].join(", ")})` : "";
}

// The delimiter that splits most lines into equally many cells.
function delimiterOf(lines) {
  let best = null;
  for (const sign of [",", ";", "\t"]) {
    const counts = new Map();
    for (const line of each(lines)) {
      const size = line.replace(/"[^"]*"/g, "").split(sign).length - 1;
      if (size) counts.set(size, (counts.get(size) ?? 0) + 1);
    }
    const [size, rows] = [...counts].sort(([s, a], [t, b]) => b - a || t - s)[0] ?? [0, 0];
    if (!best || rows > best.rows || (rows === best.rows && size > best.size)) best = { sign, rows, size };
  }
  return best.sign;
}

function csvRecords(path, written, delimiter) {
  const lines = (written.match(/[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+$/g) ?? []).map((line, k) => [k + 1, line]);
  return lines.filter(([, one]) => !one.startsWith("#")).map(([place, line]) => [place, csvCells(path, place, line, delimiter)]);
}

function csvCells(path, place, line, delimiter) {
  const refused = (reason) => new RecordingError(new Problem(path, reason, "remove the quote, or double it within a cell; no cell may span rows", place));
  const row = line.replace(/[\r\n]+$/, ""), cells = [];
  if (!row) return cells;
  let cell = "", quoted = false, closed = false, begins = true;
  for (let k = 0; k < row.length; k++) {
    const sign = row[k];
    if (quoted) {
      if (sign !== '"') cell += sign;
      else if (row[k + 1] === '"') { cell += sign; k++; }
      else { quoted = false; closed = true; }
    } else if (sign === delimiter) { cells.push(cell); cell = ""; closed = false; begins = true; continue; }
    else if (closed) throw refused("has text behind a closing quote");
    else if (sign === '"' && begins) quoted = true;
    else cell += sign;
    begins = false;
  }
  if (quoted) throw refused("has a quote that opens a cell and does not close it in the same row");
  return [...cells, cell];
}

const re = {
  fullmatch: (pattern, written) => new RegExp(`^(?:${pattern})$`, "s").exec(written),
};

const difflib = {
  get_close_matches(word, possibilities, named) {
    const { n = 3, cutoff = 0.6 } = named.values;
    const scored = each(possibilities).map((other) => [difflib.ratio(other, word), other]).filter(([score]) => score >= cutoff);
    return scored.sort(([s, a], [t, b]) => t - s || (a < b ? 1 : a > b ? -1 : 0)).slice(0, n).map(([, other]) => other);
  },
  ratio(a, b) {
    const length = a.length + b.length;
    return length ? (2 * matching(a, b, 0, a.length, 0, b.length)) / length : 1;
  },
};

// Signs that two texts share: those of the longest part in common, and of what lies before it and behind it.
function matching(a, b, aLow, aHigh, bLow, bHigh) {
  let [aBest, bBest, most] = [aLow, bLow, 0], lengths = new Map();
  for (let i = aLow; i < aHigh; i++) {
    const next = new Map();
    for (let j = bLow; j < bHigh; j++) {
      if (a[i] !== b[j]) continue;
      const length = (lengths.get(j - 1) ?? 0) + 1;
      next.set(j, length);
      if (length > most) [aBest, bBest, most] = [i - length + 1, j - length + 1, length];
    }
    lengths = next;
  }
  if (!most) return 0;
  return most + matching(a, b, aLow, aBest, bLow, bBest) + matching(a, b, aBest + most, aHigh, bBest + most, bHigh);
}

method(String.prototype, {
  splitlines() { return this.split(/\r\n|\r|\n/).filter((line, k, all) => line || k < all.length - 1); },
});
