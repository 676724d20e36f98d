// Linear algebra of small matrices, products along named axes, and splines.

function strided(a, labels, order) { // the stride of each label of `order` in `a`, 0 where it has none
  return order.map((label) => labels.reduce((sum, own, k) => sum + (own === label ? a.strides[k] : 0), 0));
}

const nameless = (labels) => [...new Set(labels.filter((label) => label[0] === "."))].sort().reverse();

Object.assign(np, {
  einsum(formula, ...given) {
    const [a, b] = given.filter((part) => part instanceof Nd);
    const [inputs, result] = formula.split("->"), [one, other] = inputs.split(",");
    const axes = (labels, array) => {
      const named = labels.replace("...", ""), free = array.ndim - named.length;
      // axes without a name are counted from the last, as they are broadcast
      return labels.startsWith("...") ? [...py.range(free).map((k) => `.${free - k}`), ...named] : [...named];
    };
    const left = axes(one, a), right = axes(other, b);
    const out = result.startsWith("...") ? [...nameless([...left, ...right]), ...result.slice(3)] : [...result];
    const summed = [...new Set([...left, ...right])].filter((label) => !out.includes(label));
    const length = (label) => (left.includes(label) ? a.shape[left.indexOf(label)] : b.shape[right.indexOf(label)]);
    if (summed.length !== 1) throw new Error(`einsum ${formula}: one axis is summed over here`);
    const product = made(out.map(length)), n = length(summed[0]);
    const [[da], [db]] = [strided(a, left, summed), strided(b, right, summed)], x = a.data, y = b.data;
    const places = [];
    forEachOffset(product.shape, strided(b, right, out), b.offset, (o) => places.push(o));
    forEachOffset(product.shape, strided(a, left, out), a.offset, (o, k) => {
      let sum = 0;
      for (let j = 0, p = o, q = places[k]; j < n; j++, p += da, q += db) sum += x[p] * y[q];
      product.data[k] = sum;
    });
    return product;
  },
  matmul(a, b) {
    if (a.ndim === 1 && b.ndim === 1) return np.sum(py.mul(a, b));
    if (b.ndim === 1) return getItem(np.matmul(a, np.reshape(b, [-1, 1])), ELLIPSIS, 0);
    if (a.ndim === 1) return getItem(np.matmul(np.reshape(a, [1, -1]), b), ELLIPSIS, 0, new Slice(null, null));
    const lead = broadcastShape(a.shape.slice(0, -2), b.shape.slice(0, -2)), [n, m, p] = [a.shape.at(-2), a.shape.at(-1), b.shape.at(-1)];
    const x = flat(broadcastTo(a, [...lead, n, m])), y = flat(broadcastTo(b, [...lead, m, p])), out = made([...lead, n, p]);
    for (let block = 0; block < sizeOf(lead); block++) {
      for (let i = 0; i < n; i++) {
        for (let j = 0; j < p; j++) {
          let sum = 0;
          for (let k = 0; k < m; k++) sum += x[(block * n + i) * m + k] * y[(block * m + k) * p + j];
          out.data[(block * n + i) * p + j] = sum;
        }
      }
    }
    return out;
  },
});

function eliminated(matrix, right, n, columns) { // solves in place, with the largest pivot of each column
  for (let k = 0; k < n; k++) {
    let pivot = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(matrix[i * n + k]) > Math.abs(matrix[pivot * n + k])) pivot = i;
    if (matrix[pivot * n + k] === 0) throw new LinAlgError("the matrix is singular");
    if (pivot !== k) {
      for (let j = 0; j < n; j++) [matrix[k * n + j], matrix[pivot * n + j]] = [matrix[pivot * n + j], matrix[k * n + j]];
      for (let j = 0; j < columns; j++) [right[k * columns + j], right[pivot * columns + j]] = [right[pivot * columns + j], right[k * columns + j]];
    }
    for (let i = k + 1; i < n; i++) {
      const factor = matrix[i * n + k] / matrix[k * n + k];
      for (let j = k; j < n; j++) matrix[i * n + j] -= factor * matrix[k * n + j];
      for (let j = 0; j < columns; j++) right[i * columns + j] -= factor * right[k * columns + j];
    }
  }
  for (let i = n - 1; i >= 0; i--) {
    for (let j = 0; j < columns; j++) {
      let sum = right[i * columns + j];
      for (let k = i + 1; k < n; k++) sum -= matrix[i * n + k] * right[k * columns + j];
      right[i * columns + j] = sum / matrix[i * n + i];
    }
  }
}

np.linalg = {
  LinAlgError,
  solve(a, b) {
    const n = a.shape.at(-1), columns = b.shape.at(-1), lead = a.shape.slice(0, -2), matrix = flat(a).slice();
    const out = flat(broadcastTo(b, [...lead, n, columns])).slice();
    for (let block = 0; block < sizeOf(lead); block++) {
      eliminated(matrix.subarray(block * n * n, (block + 1) * n * n), out.subarray(block * n * columns, (block + 1) * n * columns), n, columns);
    }
    return new Nd(out, [...lead, n, columns]);
  },
  inv: (a) => np.linalg.solve(a, np.eye(a.shape.at(-1))),
  norm: (a, named) => np.sqrt(np.sum(py.mul(a, a), named)),
  cholesky(a) {
    const n = a.shape.at(-1), out = made(a.shape.slice());
    for (let at = 0; at < out.size; at += n * n) {
      const from = flat(a).subarray(at, at + n * n), l = out.data.subarray(at, at + n * n);
      for (let i = 0; i < n; i++) {
        for (let j = 0; j <= i; j++) {
          let sum = from[i * n + j];
          for (let k = 0; k < j; k++) sum -= l[i * n + k] * l[j * n + k];
          if (i === j && !(sum > 0)) throw new LinAlgError("the matrix is not positive definite");
          l[i * n + j] = i === j ? Math.sqrt(sum) : sum / l[j * n + j];
        }
      }
    }
    return out;
  },
};

// Rows of differences d (m, n) as L^-1 d, L (n, n) lower triangular.
function whitened(lower, differences) {
  const n = lower.shape[0], l = flat(lower), out = flat(differences).slice();
  for (let row = 0; row < out.length; row += n) {
    for (let i = 0; i < n; i++) {
      let sum = out[row + i];
      for (let k = 0; k < i; k++) sum -= l[i * n + k] * out[row + k];
      out[row + i] = sum / l[i * n + i];
    }
  }
  return new Nd(out, differences.shape.slice());
}

// --- splines, evaluated as functions of their place; values (n, columns) at n nodes

class PiecewiseCubic { // value, and slope at every node
  constructor(nodes, values, slopes, columns) { Object.assign(this, { nodes, values, slopes, columns }); }
  at(x, derivative, out, start) {
    const { nodes, values, slopes, columns } = this, n = nodes.length;
    let k = 0;
    while (k < n - 2 && x >= nodes[k + 1]) k++;
    const h = nodes[k + 1] - nodes[k], t = (x - nodes[k]) / h;
    for (let c = 0; c < columns; c++) {
      const y0 = values[k * columns + c], y1 = values[(k + 1) * columns + c], d0 = slopes[k * columns + c] * h, d1 = slopes[(k + 1) * columns + c] * h;
      const c2 = 3 * (y1 - y0) - 2 * d0 - d1, c3 = d0 + d1 - 2 * (y1 - y0);
      out[start + c] = derivative ? (d0 + t * (2 * c2 + 3 * t * c3)) / h : y0 + t * (d0 + t * (c2 + t * c3));
    }
  }
  sampled(places, derivative) { // (places, columns)
    const out = made([places.size, this.columns]);
    flat(places).forEach((x, k) => this.at(x, derivative, out.data, k * this.columns));
    return out;
  }
}

// The periodic cubic spline of scipy.interpolate.CubicSpline(nodes, values, bc_type="periodic").
function periodicSlopes(x, values, columns) {
  const n = x.length - 1, h = py.range(n).map((k) => x[k + 1] - x[k]), matrix = new Float64Array(n * n), right = new Float64Array(n * columns);
  for (let k = 0; k < n; k++) {
    const before = (k + n - 1) % n, after = (k + 1) % n;
    matrix[k * n + before] += h[k];
    matrix[k * n + k] += 2 * (h[before] + h[k]);
    matrix[k * n + after] += h[before];
    for (let c = 0; c < columns; c++) {
      const up = (values[(k + 1) * columns + c] - values[k * columns + c]) / h[k];
      const down = (values[(before + 1) * columns + c] - values[before * columns + c]) / h[before];
      right[k * columns + c] = 3 * (h[k] * down + h[before] * up);
    }
  }
  cyclic(matrix, right, n, columns);
  const slopes = new Float64Array((n + 1) * columns);
  slopes.set(right);
  slopes.set(right.subarray(0, columns), n * columns);
  return slopes;
}

// Elimination that uses where a cyclic tridiagonal matrix is not zero: its band, the last row and the last column.
function cyclic(matrix, right, n, columns) {
  const reduce = (i, k) => {
    const factor = matrix[i * n + k] / matrix[k * n + k];
    if (factor === 0) return;
    for (const j of new Set([k, k + 1, n - 1])) matrix[i * n + j] -= factor * matrix[k * n + j];
    for (let c = 0; c < columns; c++) right[i * columns + c] -= factor * right[k * columns + c];
  };
  for (let k = 0; k < n - 1; k++) {
    reduce(k + 1, k);
    if (k + 1 < n - 1) reduce(n - 1, k);
  }
  for (let i = n - 1; i >= 0; i--) {
    for (let c = 0; c < columns; c++) {
      let sum = right[i * columns + c];
      if (i < n - 1) sum -= matrix[i * n + i + 1] * right[(i + 1) * columns + c];
      if (i < n - 2) sum -= matrix[i * n + n - 1] * right[(n - 1) * columns + c];
      right[i * columns + c] = sum / matrix[i * n + i];
    }
  }
}

// Slopes of Fritsch and Butland (1984) as scipy.interpolate.PchipInterpolator has them; the ends lie outside what is read.
function monotoneSlopes(x, y) {
  const n = x.length, h = py.range(n - 1).map((k) => x[k + 1] - x[k]), d = h.map((step, k) => (y[k + 1] - y[k]) / step), slopes = new Float64Array(n);
  for (let k = 1; k < n - 1; k++) {
    const [w1, w2] = [2 * h[k] + h[k - 1], h[k] + 2 * h[k - 1]];
    slopes[k] = d[k - 1] * d[k] > 0 ? (w1 + w2) / (w1 / d[k - 1] + w2 / d[k]) : 0;
  }
  return slopes;
}

const interpolate = {
  CubicSpline(nodes, values, named) {
    if (named?.values.bc_type !== "periodic") throw new Error("splines are periodic here");
    const x = flat(nodes), columns = values.shape[1];
    const spline = new PiecewiseCubic(x, flat(values), periodicSlopes(x, flat(values), columns), columns);
    return (places, derivative = 0) => spline.sampled(places, derivative);
  },
  PchipInterpolator(nodes, rows, named) {
    if (named?.values.axis !== 1) throw new Error("rows are interpolated along their second axis here");
    const x = flat(nodes);
    return (places) => np.stack(Array.from(rows, (row) => {
      const y = flat(row);
      return np.reshape(new PiecewiseCubic(x, y, monotoneSlopes(x, y), 1).sampled(places, 0), [-1]);
    }));
  },
};
