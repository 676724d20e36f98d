// What the page asks of the physics; it runs beside the page, so that the page answers meanwhile.

const nothing = () => np.zeros([0]);

function modelOf(context, recorded = null) {
  const c = call(physics.Context, [], context);
  const shared = recorded?.shared[0]?.length ? np.array(recorded.shared) : np.zeros([recorded?.phase.length ?? 0, 0]);
  const parts = recorded ? [recorded.phase, recorded.speed_m_s, recorded.relative_se].map((list) => np.array(list)) : [nothing(), nothing(), nothing()];
  return new physics.SpeedModel(new physics.SpeedRecording(c, ...parts, shared), physics.settings);
}

// Beats of rows of phi in a context: what is drawn of each, row after row.
function beats({ phi, context }) {
  const model = modelOf(context), draws = np.array(phi), made = model.simulate(draws);
  const stiffness = model.stiffness(draws, made);
  const rows = (curves) => Array.from(curves, (row) => Array.from(flat(row)));
  return {
    phase: Array.from(flat(made.cycle_phase)),
    done: Array.from(flat(made.status), (status) => status === 0),
    stiffness: rows(stiffness), volume: rows(made.volume_ml), pressure: rows(made.ventricular_pressure_mmhg),
    arterial: rows(made.arterial_pressure_mmhg), active: rows(made.active_stiffness_kpa), beats: Array.from(flat(made.beats)),
  };
}

// What a table of subjects says of their hearts.
function hearts({ name, bytes }) {
  files.contents.set(name, bytes);
  return Object.fromEntries([...physics.dropped_hearts(name)].map(([subject, heart]) => [subject, Object.fromEntries(heart)]));
}

// A recording as it was handed over, read and checked against a heart; errors of its speeds as is asked for.
function recording({ name, bytes, context, settings, noise, errors }) {
  files.contents.set(name, bytes);
  const observed = physics.dropped_recording(name, call(physics.Context, [], context), settings);
  const known = call(physics.NoiseComponents, [], noise);
  const speeds = physics.measured_speeds(observed, { study: known, separate: known.of_separate_repeats, own: null }[errors]);
  const { phase, speed_m_s, relative_se, shared } = speeds, plain = (a) => a.tolist(), total = speeds.errors.total;
  const stiffness = physics.youngs_modulus_kpa(speed_m_s, settings.density_kg_m3);
  const refused = [...observed.rejected].filter(([, count]) => count).map(([reason, count]) => `${reason} ${count}`);
  return {
    recording: {
      phase: plain(phase), speed_m_s: plain(speed_m_s), relative_se: plain(relative_se), shared: plain(shared),
      stiffness_kpa: plain(stiffness), stiffness_se_kpa: plain(py.mul(2, py.mul(stiffness, total))),
    },
    measured: phase.size, phases: observed.phase.size, accepted: np.sum(observed.samples_accepted),
    rejected: refused.length ? `rejected: ${refused.join(", ")}` : "none rejected", relative_se: np.median(total),
  };
}

// The exact posterior of a recording, from the prior of hearts on; `tell` hears of every round.
function infer({ context, recording, seed }, tell) {
  const began = performance.now(), model = modelOf(context, recording), { exact } = physics;
  let last = null;
  for (const adapted of physics.adaptive_rounds(new physics.HeartModel(model), exact, seed)) {
    last = adapted;
    tell(sampling(adapted));
  }
  const phi = physics.resample(last.weighted, exact.draws, seeds.generator(seed, "exact", "resampling"));
  const levels = physics.interval_levels(exact.interval), ends = np.array([flat(levels)[0], 0.5, flat(levels)[1]]);
  const shown = np.quantile(phi, ends, kw({ axis: 0 }));
  return {
    ...sampling(last), interval: exact.interval, phi: phi.tolist(), quantiles: shown.tolist(),
    check: predicted(model, phi, ends, seed), judged: judged(model, phi), seconds: (performance.now() - began) / 1000,
  };
}

function sampling({ weighted, reliable }) {
  const draws = weighted.phi.shape[0], limit = physics.k_hat_limit(draws, physics.exact.max_k_hat);
  const { k_hat, efficiency, log_evidence, log_evidence_se } = weighted;
  return { draws, reliable, k_hat, limit, effective: efficiency * draws, efficiency, log_evidence, log_evidence_se, wanted: physics.exact.min_effective_draws };
}

// What recordings of this noise would show if the posterior were right, beside the one that there is.
function predicted(model, phi, ends, seed) {
  const { recording, settings } = model, some = getItem(phi, py.slice(0, CHECKED)), speeds = model.predict(some);
  const drawn = physics.draw_speeds(speeds, recording.errors, settings.discrepancy, seeds.generator(seed, "predictive"));
  const stiffness = physics.youngs_modulus_kpa(drawn, settings.density_kg_m3), observed = physics.youngs_modulus_kpa(recording.speed_m_s, settings.density_kg_m3);
  const [low, median, high] = np.quantile(stiffness, ends, kw({ axis: 0 })).tolist();
  const inside = observed.tolist().filter((value, k) => value >= low[k] && value <= high[k]).length;
  return { phase: recording.phase.tolist(), low, median, high, inside, phases: low.length };
}

// The tests of the study that need no null distributions.
function judged(model, phi) {
  const [word, tests] = physics.judged_without_nulls(model, getItem(phi, py.slice(0, CHECKED)), physics.rule);
  return { word, tests: tests.map(({ name, flagged, detail }) => ({ name: name.replaceAll("_", " "), flagged, detail })) };
}

const CHECKED = 1000;
const tasks = { beats, hearts, recording, infer };

onmessage = ({ data }) => {
  try {
    postMessage({ id: data.id, result: tasks[data.task](data.given, (progress) => postMessage({ id: data.id, progress })) });
  } catch (error) {
    postMessage({ id: data.id, error: error.message });
  }
};
postMessage({ id: 0, result: true });
