// A recording of one's own: files that are dropped are read in the worker, by the checks of the study.

const hearts = {}; // of tables of subjects, by name
const isOwn = (subject) => Boolean(subject?.file);

// Which table a file is: one of subjects names them in its header.
function namesSubjects(bytes) {
  const header = new TextDecoder().decode(bytes.slice(0, 4096)).split(/\r\n|\r|\n/).find((line) => line.trim() && !line.startsWith("#")) ?? "";
  return header.split(/[,;\t]/).some((name) => name.trim().replaceAll('"', "") === "subject");
}

async function taken(given) { // tables of subjects first, so that a recording finds its row
  const read = await Promise.all(Array.from(given, async (file) => ({ name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) })));
  const tables = read.filter(({ bytes }) => namesSubjects(bytes)), recordings = read.filter(({ bytes }) => !namesSubjects(bytes));
  try {
    for (const table of tables) Object.assign(hearts, await ask("hearts", table));
  } catch (error) {
    tell(error.message, true);
    return;
  }
  for (const file of recordings) await offered(file);
  if (recordings.length) return;
  if (isOwn(state.subject)) await offered(state.subject.file);
  else tell(`Hearts of ${Object.keys(hearts).join(", ")}: now drop a recording of one of them.`);
}

async function offered(file) { // it becomes a subject at once, and has a recording once it passes
  const name = file.name.replace(/\.[^.]*$/, ""), heart = hearts[name];
  const context = { ...state.context, lvesv_ml: NaN, ...heart, subject: name }; // the end-systolic volume is known of a row alone
  const origin = heart ? "its row of the table" : "the sliders";
  const subject = { name, file, context, origin, verdict: "A recording of your own, not yet judged.", recording: null, median: null, quantiles: null, draws: [] };
  listed(subject);
  choose(subject);
  await readAgain();
}

async function readAgain() { // where its heart or its errors may be others
  const { subject } = state, { origin } = subject, errors = element("errors").value, current = () => state.subject === subject;
  try {
    const found = await ask("recording", { ...subject.file, context: state.context, settings: study.quality, noise: study.noise, errors });
    if (!current()) return;
    subject.recording = found.recording;
    tell(`${subject.name}: ${found.measured} of ${found.phases} phases, ${found.accepted} samples accepted, ${found.rejected}. `
      + `Standard error of a phase's speed: ${(100 * found.relative_se).toFixed(1)} % in the median. The heart is that of ${origin}.`);
  } catch (error) {
    if (!current()) return;
    subject.recording = null;
    tell(`${error.message}${origin === "the sliders" ? "\nThe heart is that of the sliders: move them to that of the recording, or drop its table of subjects too." : ""}`, true);
  }
  element("infer").disabled = !subject.recording;
  document.body.dataset.own = subject.recording ? subject.name : "";
  drawAll();
}

function listed(subject) { // in the place of a file of the same name, if there was one
  const select = element("subject"), before = study.subjects.findIndex((other) => isOwn(other) && other.name === subject.name);
  const place = before < 0 ? study.subjects.length : before;
  study.subjects[place] = subject;
  if (before < 0) select.append(new Option(`${subject.name} (your file)`, String(place)));
  select.value = String(place);
}

function tell(words, wrong = false) {
  element("own-words").textContent = words;
  element("own-words").classList.toggle("wrong", wrong);
}

function beginOwn() {
  const { sweep_fraction: sweeps } = study.noise;
  const ways = [["study", sweeps ? "as in the study, repeats are sweeps" : "as in the study"], ...(sweeps ? [["separate", "as in the study, each phase repeated by itself"]] : []), ["own", "from its own repeats"]];
  for (const [value, words] of ways) element("errors").append(new Option(words, value));
  element("errors").addEventListener("change", () => { if (isOwn(state.subject)) { forget(); readAgain(); } });
  element("files").addEventListener("change", () => taken(element("files").files));
  document.addEventListener("dragover", (event) => { event.preventDefault(); document.body.classList.add("dropping"); });
  document.addEventListener("dragleave", () => document.body.classList.remove("dropping"));
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    document.body.classList.remove("dropping");
    taken(event.dataTransfer.files);
  });
}
