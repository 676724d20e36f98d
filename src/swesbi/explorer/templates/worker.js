// What the page asks of the physics; it runs beside the page, so that the page answers meanwhile.

const nothing = () => np.zeros([0]);

function modelOf(context, recorded = null) {
  const c = call(physics.Context, [], context);
  const shared = recorded?.shared[0]?.length ? np.array(recorded.shared) : np.zeros([recorded?.phase.length ?? 0, 0]);
  const parts = recorded ? [recorded.phase, recorded.speed_m_s, recorded.relative_se].map((list) => np.array(list)) : [nothing(), nothing(), nothing()];
  return physics.speed_model(new physics.SpeedRecording(c, ...parts, shared), physics.settings);
}

// Beats of rows of phi in a context: what is drawn of each, row after row.
function beats({ phi, context }) {
  const model = modelOf(context), draws = np.array(phi), made = model.simulate(draws), n = phi.length;
  const stiffness = np.stack(py.range(n).map((k) => model.stiffness_cycle(getItem(draws, k), made, k)));
  const rows = (curves) => Array.from(curves, (row) => Array.from(flat(row)));
  return {
    phase: Array.from(flat(made.cycle_phase)),
    done: Array.from(flat(made.status), (status) => status === 0),
    stiffness: rows(stiffness), volume: rows(made.volume_ml), pressure: rows(made.ventricular_pressure_mmhg),
    arterial: rows(made.arterial_pressure_mmhg), active: rows(made.active_stiffness_kpa), beats: Array.from(flat(made.beats)),
  };
}

const tasks = { beats };

onmessage = ({ data }) => {
  try {
    postMessage({ id: data.id, result: tasks[data.task](data.given) });
  } catch (error) {
    postMessage({ id: data.id, error: error.message });
  }
};
postMessage({ id: 0, result: true });
