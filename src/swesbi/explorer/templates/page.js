// The page: sliders, what they ask of the worker, and what is drawn of its answers.

"use strict";
const study = JSON.parse(document.getElementById("study").textContent);
const element = (id) => document.getElementById(id);
const state = { subject: null, phi: study.parameters.map((p) => p.centre), context: { ...study.context }, own: null, prior: null, posterior: null, turn: 0 };
const TOGETHER = 8, ROWS = ["done", "stiffness", "volume", "pressure", "arterial", "active", "beats"];
const strips = new Map(), sliders = new Map();
const plots = {
  stiffness: new Plot("stiffness", "cycle"), volume: new Plot("volume", "cycle"),
  pressure: new Plot("pressure", "cycle"), loop: new Plot("loop", "volume (mL)"),
};

// --- the worker: each question has a number, and of sliders the last alone counts

const source = URL.createObjectURL(new Blob([element("worker").textContent], { type: "text/javascript" }));
const worker = new Worker(source), waiting = new Map();
let last = 0;
worker.onmessage = ({ data }) => {
  waiting.get(data.id)?.(data);
  waiting.delete(data.id);
};
worker.onerror = (event) => say(`The model could not be loaded: ${event.message}`, true);
const ready = new Promise((resolve) => waiting.set(0, resolve));
function ask(task, given) {
  return new Promise((resolve, reject) => {
    waiting.set(++last, ({ result, error }) => (error === undefined ? resolve(result) : reject(new Error(error))));
    worker.postMessage({ id: last, task, given });
  });
}

let busy = false, wanted = false;
async function moved() { // a new beat for the sliders; while one is computed the newest waits
  wanted = true;
  if (busy) return;
  busy = true;
  while (wanted) {
    wanted = false;
    const began = performance.now();
    try {
      const found = await ask("beats", { phi: [state.phi], context: state.context });
      state.own = found.done[0] ? found : null;
      const took = performance.now() - began;
      say(found.done[0] ? `Periodic after ${found.beats[0]} beats, ${took.toFixed(0)} ms.` : "These parameters have no periodic beat.", !found.done[0]);
      document.body.dataset.answered = String(Number(document.body.dataset.answered ?? 0) + 1);
      document.body.dataset.took = took.toFixed(1);
    } catch (error) {
      state.own = null;
      say(error.message, true);
    }
    drawAll();
  }
  busy = false;
}

function say(words, wrong = false) {
  element("status").textContent = words;
  element("status").classList.toggle("wrong", wrong);
}

// --- sliders; those of parameters run along the logarithm between the prior's bounds

const place = (p, value) => Math.log(value / p.low) / Math.log(p.high / p.low);
const shown = (value) => String(Number(value.toPrecision(4)));

function slider(p, host, read, write, strip) {
  const row = document.createElement("div");
  row.className = "parameter";
  row.innerHTML = `<label for="${p.name}">${p.words} ${p.symbol} (${p.unit})</label><input type="number" id="${p.name}-value" step="any" min="${p.low}" max="${p.high}">`
    + `<input type="range" id="${p.name}" min="0" max="1" step="0.001">${strip ? `<canvas tabindex="0" role="img" aria-label="Draws of ${p.words}"></canvas>` : ""}`;
  host.append(row);
  const [number, range] = row.querySelectorAll("input");
  number.setAttribute("aria-label", `${p.words}, as a number`);
  const show = () => { number.value = shown(read()); range.value = place(p, read()); range.setAttribute("aria-valuetext", `${shown(read())} ${p.unit}`); };
  range.addEventListener("input", () => { write(p.low * (p.high / p.low) ** Number(range.value)); show(); moved(); });
  number.addEventListener("change", () => {
    if (number.value !== "" && Number.isFinite(Number(number.value))) write(Math.min(p.high, Math.max(p.low, Number(number.value))));
    show();
    moved();
  });
  sliders.set(p.name, show);
  if (strip) strips.set(p.name, new Strip(row.querySelector("canvas"), drawAll));
}

function makeSliders() {
  study.parameters.forEach((p, k) => slider(p, element(p.reported ? "theta" : "nuisances"), () => state.phi[k], (value) => { state.phi[k] = value; }, true));
  study.context_sliders.forEach((p) => slider(p, element("context"), () => state.context[p.name], (value) => { state.context[p.name] = value; changedContext(); }, false));
}

let delayed = null;
function changedContext() { // draws are of another heart now; they follow when the slider rests
  clearTimeout(delayed);
  delayed = setTimeout(loadDraws, 150);
}

// --- draws of prior and posterior

// A few at a time, so that a slider that is moved meanwhile waits for a few alone; another heart ends it.
async function beatsOf(draws, context, current) {
  let found = null;
  for (let first = 0; first < draws.length; first += TOGETHER) {
    const part = await ask("beats", { phi: draws.slice(first, first + TOGETHER), context });
    if (!current()) return null;
    if (found) for (const name of ROWS) found[name].push(...part[name]);
    else found = part;
  }
  return found;
}

async function loadDraws() {
  const turn = ++state.turn, current = () => turn === state.turn, context = { ...state.context };
  state.prior = state.posterior = null;
  try {
    const posterior = state.subject ? await beatsOf(state.subject.draws, context, current) : null;
    if (!current()) return;
    state.posterior = posterior;
    drawAll();
    const prior = element("show-prior").checked ? await beatsOf(study.prior_draws, context, current) : null;
    if (!current()) return;
    state.prior = prior;
    document.body.dataset.drawn = String(turn);
  } catch (error) {
    say(error.message, true);
  }
  drawAll();
}

function choose(subject) {
  state.subject = subject;
  state.context = { ...subject.context };
  state.phi = subject.median.slice();
  element("verdict").textContent = subject.verdict;
  for (const show of sliders.values()) show();
  moved();
  loadDraws();
}

// --- linked brushing: a draw is chosen if it lies in every window of a parameter and its curve passes the box

function chosenDraws() {
  const draws = state.subject ? state.subject.draws : [], box = plots.stiffness.box;
  return draws.map((phi, row) => {
    const inside = study.parameters.every((p, k) => {
      const range = strips.get(p.name).window, x = place(p, phi[k]);
      return !range || (x >= range[0] && x <= range[1]);
    });
    if (!inside || !box || !state.posterior) return inside;
    const { phase, stiffness } = state.posterior;
    return phase.some((x, k) => x >= box[0] && x <= box[1] && stiffness[row][k] >= box[2] && stiffness[row][k] <= box[3]);
  });
}

function drawAll() {
  const chosen = chosenDraws(), layers = { stiffness: [], volume: [], pressure: [], loop: [] };
  const add = (found, row, style) => {
    if (!found.done[row]) return;
    const x = found.phase;
    for (const name of ["stiffness", "volume", "pressure"]) layers[name].push({ x, y: found[name][row], ...style });
    layers.loop.push({ x: found.volume[row], y: found.pressure[row], ...style, closed: true });
  };
  if (state.prior && element("show-prior").checked) state.prior.done.forEach((_, row) => add(state.prior, row, { tone: "prior", alpha: 0.25 }));
  if (state.posterior && element("show-posterior").checked) {
    chosen.forEach((yes, row) => add(state.posterior, row, { tone: "posterior", alpha: yes ? 0.4 : 0.04 }));
  }
  if (state.own) {
    add(state.own, 0, { tone: "own", width: 2.5 });
    layers.pressure.push({ x: state.own.phase, y: state.own.arterial[0], tone: "own", width: 1.5, dash: [5, 4] });
  }
  if (state.subject && element("show-recording").checked) {
    const { phase, stiffness_kpa, stiffness_se_kpa } = state.subject.recording;
    layers.stiffness.push({ x: phase, y: stiffness_kpa, error: stiffness_se_kpa, tone: "ink" });
  }
  for (const [name, plot] of Object.entries(plots)) plot.draw(layers[name]);
  study.parameters.forEach((p, k) => {
    const marks = (draws) => draws.map((phi) => place(p, phi[k]));
    strips.get(p.name).draw(marks(study.prior_draws), state.subject ? marks(state.subject.draws) : [], chosen);
  });
  const count = chosen.filter(Boolean).length;
  document.body.dataset.chosen = String(count);
  numbers(count, chosen.length);
}

function numbers(count, draws) {
  const rows = [];
  if (state.own) {
    const [volume, pressure] = [state.own.volume[0], state.own.pressure[0]], [high, low] = [Math.max(...volume), Math.min(...volume)];
    rows.push(["End-diastolic volume", `${high.toFixed(0)} mL`], ["End-systolic volume", `${low.toFixed(0)} mL`], ["Ejection fraction", `${(100 * (1 - low / high)).toFixed(0)} %`]);
    rows.push(["Largest ventricular pressure", `${Math.max(...pressure).toFixed(0)} mmHg`], ["Largest stiffness", `${Math.max(...state.own.stiffness[0]).toFixed(1)} kPa`]);
  }
  if (draws) rows.push(["Draws picked", `${count} of ${draws}`]);
  element("numbers").innerHTML = rows.map(([name, value]) => `<tr><th scope="row">${name}</th><td>${value}</td></tr>`).join("");
}

// --- beginning

function begin() {
  makeSliders();
  study.subjects.forEach((subject, k) => element("subject").append(new Option(subject.name, String(k))));
  element("subject").addEventListener("change", () => choose(study.subjects[Number(element("subject").value)]));
  element("centre").addEventListener("click", () => set(study.parameters.map((p) => p.centre)));
  element("median").addEventListener("click", () => set(state.subject.median));
  for (const name of ["posterior", "recording"]) element(`show-${name}`).addEventListener("change", drawAll);
  element("show-prior").addEventListener("change", loadDraws);
  plots.stiffness.onBrush(drawAll);
  new ResizeObserver(drawAll).observe(element("curves"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
  element("nuisances").closest("details").addEventListener("toggle", drawAll);
  ready.then(() => choose(study.subjects[0]));
}

function set(phi) {
  state.phi = phi.slice();
  for (const show of sliders.values()) show();
  moved();
}

begin();
