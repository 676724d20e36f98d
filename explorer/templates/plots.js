// Curves on a canvas: axes with round numbers, many faint curves, a clear one, points with errors, and a brush.

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

function sized(canvas) { // the canvas in the screen's own pixels; drawn in those of the page
  const { width, height } = canvas.getBoundingClientRect(), scale = window.devicePixelRatio || 1;
  canvas.width = Math.max(1, Math.round(width * scale));
  canvas.height = Math.max(1, Math.round(height * scale));
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  return { pen, width, height };
}

function roundTicks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= raw), ticks = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) ticks.push(Number((k * step).toPrecision(12)));
  return ticks;
}

class Plot {
  constructor(id, xLabel) {
    this.canvas = document.getElementById(id);
    this.xLabel = xLabel;
    this.layers = [];
    this.box = null; // what is brushed: [x0, x1, y0, y1] in the plot's units
  }
  range() {
    const xs = [], ys = [];
    for (const { x, y } of this.layers) for (let k = 0; k < x.length; k++) if (Number.isFinite(y[k])) { xs.push(x[k]); ys.push(y[k]); }
    if (!xs.length) return [0, 1, 0, 1];
    const ends = (list) => [list.reduce((a, b) => Math.min(a, b)), list.reduce((a, b) => Math.max(a, b))];
    const [x0, x1] = this.xLabel === "cycle" ? [0, 1] : ends(xs), [y0, y1] = ends([...ys, ...(this.xLabel === "cycle" ? [0] : [])]);
    const room = 0.06 * (y1 - y0 || 1), side = this.xLabel === "cycle" ? 0 : 0.06 * (x1 - x0 || 1);
    return [x0 - side, x1 + side, y0 === 0 ? 0 : y0 - room, y1 + room];
  }
  draw(layers = this.layers) {
    this.layers = layers;
    const { pen, width, height } = sized(this.canvas), [x0, x1, y0, y1] = this.range();
    const [left, right, top, bottom] = [42, width - 8, 8, height - 30];
    this.toX = (x) => left + ((x - x0) / (x1 - x0)) * (right - left);
    this.toY = (y) => bottom - ((y - y0) / (y1 - y0)) * (bottom - top);
    this.fromX = (px) => x0 + ((px - left) / (right - left)) * (x1 - x0);
    this.fromY = (py) => y0 + ((bottom - py) / (bottom - top)) * (y1 - y0);
    this.axes(pen, [x0, x1, y0, y1], [left, right, top, bottom]);
    pen.save();
    pen.beginPath();
    pen.rect(left, top, right - left, bottom - top);
    pen.clip();
    for (const layer of layers) this.curve(pen, layer);
    if (this.box) this.brushed(pen);
    pen.restore();
  }
  axes(pen, [x0, x1, y0, y1], [left, right, top, bottom]) {
    pen.font = "12px system-ui, sans-serif";
    pen.fillStyle = colour("soft");
    pen.strokeStyle = colour("line");
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const tick of roundTicks(y0, y1, 5)) {
      const y = this.toY(tick);
      pen.beginPath(); pen.moveTo(left, y); pen.lineTo(right, y); pen.stroke();
      pen.fillText(String(tick), left - 5, y);
    }
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (const tick of roundTicks(x0, x1, 5)) pen.fillText(String(tick), this.toX(tick), bottom + 4);
    pen.fillText(this.xLabel === "cycle" ? "phase of the cycle" : this.xLabel, (left + right) / 2, bottom + 17);
    pen.strokeRect(left, top, right - left, bottom - top);
  }
  curve(pen, { x, y, error, tone, alpha = 1, width = 1, dash = [], closed = false }) {
    pen.globalAlpha = alpha;
    pen.strokeStyle = pen.fillStyle = colour(tone);
    pen.lineWidth = width;
    pen.setLineDash(dash);
    if (error) {
      for (let k = 0; k < x.length; k++) {
        const px = this.toX(x[k]);
        pen.beginPath(); pen.moveTo(px, this.toY(y[k] - error[k])); pen.lineTo(px, this.toY(y[k] + error[k])); pen.stroke();
        pen.beginPath(); pen.arc(px, this.toY(y[k]), 3, 0, 7); pen.fill();
      }
    } else {
      pen.beginPath();
      for (let k = 0; k < x.length; k++) pen.lineTo(this.toX(x[k]), this.toY(y[k]));
      if (closed) pen.closePath();
      pen.stroke();
    }
    pen.globalAlpha = 1;
    pen.setLineDash([]);
  }
  brushed(pen) {
    const [x0, x1, y0, y1] = this.box;
    pen.globalAlpha = 0.18;
    pen.fillStyle = colour("own");
    pen.fillRect(this.toX(x0), this.toY(y1), this.toX(x1) - this.toX(x0), this.toY(y0) - this.toY(y1));
    pen.globalAlpha = 1;
  }
  onBrush(changed) { // drag a box; a click or Escape takes it away; arrows move a window of phases over the whole height
    let start = null;
    const at = (event) => { const r = this.canvas.getBoundingClientRect(); return [event.clientX - r.left, event.clientY - r.top]; };
    const end = (event) => {
      const [px, py] = at(event), xs = [start[0], px].map(this.fromX).sort((a, b) => a - b), ys = [start[1], py].map(this.fromY).sort((a, b) => a - b);
      this.box = Math.abs(px - start[0]) + Math.abs(py - start[1]) < 5 ? null : [...xs, ...ys];
      changed();
    };
    this.canvas.addEventListener("pointerdown", (event) => { start = at(event); this.canvas.setPointerCapture(event.pointerId); });
    this.canvas.addEventListener("pointermove", (event) => { if (start) end(event); });
    this.canvas.addEventListener("pointerup", (event) => { if (start) end(event); start = null; });
    this.canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
      if (event.key === "Escape") this.box = null;
      else if (step === undefined) return;
      else {
        const [, , low, high] = this.range(), [x0, x1, y0, y1] = this.box ?? [0.3, 0.4, low, (low + high) / 2];
        this.box = event.shiftKey ? [x0, Math.min(1, Math.max(x0 + 0.02, x1 + step)), y0, y1] : [x0 + step, x1 + step, y0, y1];
      }
      event.preventDefault();
      changed();
    });
  }
}

// Draws of one parameter as marks along its slider, on the scale of the slider from 0 to 1, with a brush.
class Strip {
  constructor(canvas, changed) {
    this.canvas = canvas;
    this.window = null;
    this.changed = changed;
    let start = null;
    const at = (event) => { const r = canvas.getBoundingClientRect(); return Math.min(1, Math.max(0, (event.clientX - r.left) / r.width)); };
    canvas.addEventListener("pointerdown", (event) => { start = at(event); canvas.setPointerCapture(event.pointerId); });
    const end = (event) => { const x = at(event); this.set(Math.abs(x - start) < 0.01 ? null : [Math.min(x, start), Math.max(x, start)]); };
    canvas.addEventListener("pointermove", (event) => { if (start !== null) end(event); });
    canvas.addEventListener("pointerup", (event) => { if (start !== null) end(event); start = null; });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }
  key(event) {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
    if (event.key === "Escape") this.set(null);
    else if (step !== undefined) {
      const [low, high] = this.window ?? [0.4, 0.6];
      this.set(event.shiftKey ? [low, Math.min(1, Math.max(low + 0.02, high + step))] : [low + step, high + step]);
    } else return;
    event.preventDefault();
  }
  set(range) { this.window = range; this.changed(); }
  draw(prior, posterior, chosen) {
    const { pen, width, height } = sized(this.canvas);
    const mark = (places, tone, top, bottom, alpha) => {
      pen.fillStyle = colour(tone);
      places.forEach((x, k) => { pen.globalAlpha = alpha(k); pen.fillRect(x * width - 0.75, top, 1.5, bottom - top); });
      pen.globalAlpha = 1;
    };
    if (this.window) {
      pen.globalAlpha = 0.25;
      pen.fillStyle = colour("own");
      pen.fillRect(this.window[0] * width, 0, (this.window[1] - this.window[0]) * width, height);
      pen.globalAlpha = 1;
    }
    mark(prior, "prior", height / 2, height, () => 0.3);
    mark(posterior, "posterior", 0, height / 2, (k) => (chosen[k] ? 0.75 : 0.12));
  }
}
