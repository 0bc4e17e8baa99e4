// Linear approximations at a design near one that was analysed and differentiated: r(b) ≈ r(b₀) + Σ ∂r/∂b_k (b_k − b₀_k).

// Relative rounding error of an analysis.
const ROUNDING = 1e-12;

const changes = (base, design) => design.map((value, k) => value - base.design[k]);

function history(gradients, step) {
  return gradients.values.map((value, i) => gradients.by.reduce((sum, by, k) => sum + by[i] * step[k], value));
}

// The smallest distance of values from a limit: negative where the constraint is violated.
export function margin(relation, limit, values) {
  const of = { "≤": (v) => limit - v, "≥": (v) => v - limit, "=": (v) => -Math.abs(v - limit) }[relation];
  return values.reduce((least, v) => Math.min(least, of(v)), Infinity);
}

// A history that is computed when it is drawn, and its margin from a limit.
class Predicted {
  constructor(rows, step, { relation, limit } = {}) {
    Object.assign(this, { rows, step, relation, limit, points: rows.points });
  }

  get values() {
    return (this.known ??= history(this.rows, this.step));
  }

  get margin() {
    return margin(this.relation, this.limit, this.values);
  }
}

export function predict(base, design, constraints) {
  const step = changes(base, design);
  const { derivatives } = base;
  const peak = derivatives.peak.flatMap((rows) => history(rows, step));
  return {
    objective: peak.length ? Math.max(...peak)
      : derivatives.objective ? derivatives.objective.reduce((sum, d, k) => sum + d * step[k], base.objective) : null,
    outputs: derivatives.outputs.map((rows) => new Predicted(rows, step)),
    constraints: derivatives.constraints.map((rows, j) => new Predicted(rows, step, { relation: constraints[j].relation, limit: base.constraints[j].limit })),
  };
}

// A frame of the motion; null if the motion has no derivatives.
export function predictFrame(base, design, frame) {
  const by = base.derivatives?.motion;
  if (!by) return null;
  const step = changes(base, design);
  return base.motion.frames[frame].map((value, i) => by.reduce((sum, rows, k) => sum + rows[frame][i] * step[k], value));
}

// Derivatives of the objective (`constraint` is null) and of the margins with respect to variable k, where each margin is smallest. What is below the rounding of the values
// over a step of the variable's size counts as zero.
export function effects(base, k, model) {
  const { derivatives } = base;
  const all = [];
  const largest = (rows) => rows.values.reduce((best, v, i) => (best < 0 || v > rows.values[best] ? i : best), -1);
  if (derivatives.objective) all.push({ constraint: null, slope: derivatives.objective[k], size: Math.abs(base.objective) });
  const peak = derivatives.peak.filter((rows) => rows.values.length).map((rows) => ({ rows, i: largest(rows) }))
    .sort((a, b) => b.rows.values[b.i] - a.rows.values[a.i])[0];
  if (peak) all.push({ constraint: null, slope: peak.rows.by[k][peak.i], size: Math.abs(base.objective) });
  derivatives.constraints.forEach((rows, j) => {
    const { relation } = model.constraints[j];
    const { limit } = base.constraints[j];
    const margins = rows.values.map((v) => margin(relation, limit, [v]));
    const i = margins.indexOf(Math.min(...margins));
    if (i < 0) return;
    const sign = relation === "≥" ? 1 : relation === "≤" ? -1 : -Math.sign(rows.values[i] - limit);
    const size = Math.max(Math.abs(limit), ...rows.values.map(Math.abs));
    all.push({ constraint: j, slope: sign * rows.by[k][i], size });
  });
  const change = Math.abs(base.design[k]) || 1;
  return all.map((one) => (Math.abs(one.slope) * change < ROUNDING * one.size ? { ...one, slope: 0 } : one));
}
