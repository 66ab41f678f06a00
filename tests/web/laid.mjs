// Answers of the contract's shape for what takes minutes to come about, to be laid over those of the program.
export const BOWLED = { world: "bowling", title: "Leave the six-seven", model: {}, constraints: [{ kind: "pins", down: [1, 2, 3, 4, 5, 8, 9, 10] }] };
export const ODDS = { probability: 1 / 1512, low: 1 / 1887, high: 1 / 1213, basis: "learned", draws: 31204, hits: 9120 };
export const DIFFICULTY = { verdict: "rare", one_in: 1400, at_least: 390, draws: 1400, hits: 1, seconds: 1 };
const quantity = (name, ess_bulk, rhat = 1.01) => ({ name, unit: "", rhat, ess_bulk, ess_tail: 0.7 * ess_bulk, ess_within: 2.4 * ess_bulk, ess_across: null, mean: 0.2, sd: 1.3 });
export const DIAGNOSTICS = {
  quantities: [
    ...["ball_speed", "entry_angle", "ball_offset", "spin_axis", "spin_rate", "pin_1_x", "pin_5_x", "pin_7_x"].map((name, at) => quantity(name, 240 - 11 * at)),
    { ...quantity("lane_friction", 121, 1.03), ess_within: 210, ess_across: 84.4 },
    { name: "pins_down", unit: "", rhat: null, ess_bulk: null, ess_tail: null, ess_within: null, ess_across: null, mean: 8, sd: 0 },
  ],
  quantity_count: 10,
  chains: 4,
  draws_per_chain: 250,
  effective: { samples: 84.4, quantity: "lane_friction", within: 210, per_cpu_minute: 5.24 },
  odds: ODDS,
  first_sample: { seconds: 0.31 },
  eta_seconds: null,
  saved: { iterations: 90000, simulations: 61000, simulated_seconds: 40000, skipped_seconds: 63000, share: 0.611 },
  swaps: [],
};
export const NOTHING = {
  ...DIAGNOSTICS,
  quantities: [],
  quantity_count: 0,
  chains: 0,
  draws_per_chain: 0,
  effective: null,
  odds: { probability: 0, low: 0, high: 1 / 3253, basis: "rejection", draws: 12000, hits: 0 },
  first_sample: null,
  eta_seconds: 41,
  saved: { ...DIAGNOSTICS.saved, share: 0.42 },
};
export const CHAIN = {
  id: "c0", index: 0, seed: 7, method: "conditional", ratios: "exact", state: "running", stop: {}, iteration: 8000, accepted: 900,
  samples: 43, simulations: 5200, failed_simulations: 0, simulated_seconds: 9000, skipped_seconds: 2000, run_seconds: 8, iterations_per_second: 640,
  kernels: [{ name: "redraw", proposed: 8000, accepted: 900 }], first_sample: { iteration: 700, seconds: 0.31 }, ended_by: null,
  phase: "exploring", guided: false, effective_samples: null, error: null, created_at: "2026-01-01T00:00:00Z",
};
export const ladder = (chain, rates) => rates.map((rate, at) => ({ chain, low: at / rates.length, high: (at + 1) / rates.length, proposed: 400, accepted: Math.round(400 * rate) }));
export const TRACE = { iteration: [1, 400, 800], log_prior: [-9, -8.5, -9.2], log_constraint: [-5, 0, 0], satisfied: [false, true, true] };
