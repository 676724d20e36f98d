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

// A worker with questions of its own; what it tells on the way goes to `heard`.
class Asked {
  constructor(failed) {
    this.worker = new Worker(source);
    this.waiting = new Map();
    this.last = 0;
    this.ready = new Promise((resolve) => this.waiting.set(0, { resolve }));
    this.worker.onerror = (event) => failed(`The model could not be loaded: ${event.message}`);
    this.worker.onmessage = ({ data }) => {
      const { resolve, reject, heard } = this.waiting.get(data.id);
      if (data.progress) { heard?.(data.progress); return; }
      this.waiting.delete(data.id);
      if (data.error === undefined) resolve(data.result);
      else reject(new Error(data.error));
    };
  }
  ask(task, given, heard) {
    return new Promise((resolve, reject) => {
      this.waiting.set(++this.last, { resolve, reject, heard });
      this.worker.postMessage({ id: this.last, task, given });
    });
  }
  end() { this.worker.terminate(); }
}

const source = URL.createObjectURL(new Blob([element("worker").textContent], { type: "text/javascript" }));
const model = new Asked((words) => say(words, true));
const ask = (task, given) => model.ask(task, given);

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
function changedContext() { // draws are of another heart now, and so is what was inferred; draws follow when the slider rests
  forget();
  clearTimeout(delayed);
  if (isOwn(state.subject)) state.subject.origin = "the sliders";
  delayed = setTimeout(() => { loadDraws(); if (isOwn(state.subject)) readAgain(); }, 150);
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

function forget() { // what was inferred of another recording, or in another heart
  stop();
  element("answer").hidden = true;
  element("sampling").textContent = "";
  state.inferred = null;
}

function choose(subject) {
  forget();
  state.subject = subject;
  state.context = { ...subject.context };
  state.phi = (subject.median ?? study.parameters.map((p) => p.centre)).slice();
  element("median").disabled = !subject.median;
  element("infer").disabled = !subject.recording;
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
  if (state.inferred) {
    const { phase, low, high } = state.inferred.check;
    for (const y of [low, high]) layers.stiffness.push({ x: phase, y, tone: "ink", width: 1, dash: [2, 3] });
  }
  if (state.subject?.recording && element("show-recording").checked) {
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

// --- inference, by a worker of its own, so that the sliders go on

let inferring = null;

async function infer() {
  stop();
  const subject = state.subject, began = new Asked(tellSampling);
  inferring = began;
  element("infer").disabled = true;
  element("stop").disabled = false;
  element("answer").hidden = true;
  tellSampling("Simulating the first draws.");
  try {
    const given = { context: { ...state.context }, recording: subject.recording, seed: 1 };
    await began.ready;
    const found = await began.ask("infer", given, (progress) => {
      element("progress").value = progress.effective / progress.wanted;
      tellSampling(`${progress.draws} simulations, ${progress.effective.toFixed(0)} effective of ${progress.wanted} wanted, Pareto shape ${progress.k_hat.toFixed(2)}.`);
    });
    answered(subject, found);
  } catch (error) {
    tellSampling(error.message);
  }
  stop();
}

function stop() {
  inferring?.end();
  inferring = null;
  element("infer").disabled = !state.subject?.recording;
  element("stop").disabled = true;
}

function tellSampling(words) { element("sampling").textContent = words; }

function csvOf(found) { return `${[study.parameters.map((p) => p.name), ...found.phi].map((row) => row.join(",")).join("\n")}\n`; }

function answered(subject, found) {
  state.inferred = found;
  const quality = `Pareto shape ${found.k_hat.toFixed(2)} (limit ${found.limit.toFixed(2)}), ${found.effective.toFixed(0)} effective of ${found.draws} draws (${(100 * found.efficiency).toFixed(0)} %)`;
  tellSampling(found.reliable
    ? `Reliable: ${quality}, log evidence ${found.log_evidence.toFixed(2)}, in ${found.seconds.toFixed(1)} s.`
    : `Not reliable: ${quality}, at least ${found.wanted} wanted. Do not read the posterior; the study would go on by MCMC.`);
  element("answer-title").textContent = `Subject ${subject.name}: medians with ${(100 * found.interval).toFixed(0)} % intervals`;
  const cell = ([low, median, high]) => `${shown(median)} (${shown(low)} to ${shown(high)})`;
  element("quantiles").innerHTML = study.parameters.map((p, k) => (p.reported
    ? `<tr><th scope="row">${p.words} ${p.symbol} (${p.unit})</th><td>${cell(found.quantiles.map((row) => row[k]))}</td><td>${subject.quantiles ? cell(subject.quantiles.map((row) => row[k])) : "–"}</td></tr>` : "")).join("");
  const { inside, phases } = found.check;
  element("check").textContent = `Predictive check: ${inside} of ${phases} measured phases lie in the ${(100 * found.interval).toFixed(0)} % interval of what such a recording of this posterior would show, noise included (band among the curves).`;
  said(found.judged);
  URL.revokeObjectURL(element("download").href);
  element("download").href = URL.createObjectURL(new Blob([csvOf(found)], { type: "text/csv" }));
  element("download").download = `posterior-${subject.name}.csv`;
  element("answer").hidden = false;
  if (isOwn(subject)) adopted(subject, found);
  document.body.dataset.inferred = subject.name;
  drawAll();
}

function said({ word, tests }) { // by the tests that need no null distributions
  const words = { "no verdict": "No verdict: the tests of this page do not contradict the model", doubtful: "Doubtful", contradicted: "Contradicted" }[word];
  element("judged").textContent = `${words}.`;
  element("tests").innerHTML = tests.map(({ name, flagged, detail }) => `<li${flagged ? ' class="wrong"' : ""}>${name}: ${detail}</li>`).join("");
}

function adopted(subject, found) { // of a recording of one's own there are no other draws
  const step = found.phi.length / study.prior_draws.length;
  subject.draws = study.prior_draws.map((_, k) => found.phi[Math.floor(k * step)]);
  subject.median = found.quantiles[1];
  subject.verdict = element("judged").textContent;
  element("verdict").textContent = subject.verdict;
  element("median").disabled = false;
  loadDraws();
}

// --- beginning

function begin() {
  makeSliders();
  beginOwn();
  study.subjects.forEach((subject, k) => element("subject").append(new Option(subject.name, String(k))));
  element("subject").addEventListener("change", () => {
    choose(study.subjects[Number(element("subject").value)]);
    if (isOwn(state.subject)) readAgain();
  });
  element("centre").addEventListener("click", () => set(study.parameters.map((p) => p.centre)));
  element("median").addEventListener("click", () => set(state.subject.median));
  for (const name of ["posterior", "recording"]) element(`show-${name}`).addEventListener("change", drawAll);
  element("show-prior").addEventListener("change", loadDraws);
  plots.stiffness.onBrush(drawAll);
  new ResizeObserver(drawAll).observe(element("curves"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
  element("nuisances").closest("details").addEventListener("toggle", drawAll);
  element("infer").addEventListener("click", infer);
  element("stop").addEventListener("click", stop);
  model.ready.then(() => choose(study.subjects[0]));
}

function set(phi) {
  state.phi = phi.slice();
  for (const show of sliders.values()) show();
  moved();
}

begin();
