// The shapes that cross the boundary to the server, as the HTTP contract gives them. Types only.

/** @typedef {{kind: string, [key: string]: any}} Constraint */
/** @typedef {{running: number, paused: number, finished: number, failed: number}} ChainCounts */
/** @typedef {{probability: number, low: number, high: number, basis: "learned"|"rejection"|"ladder", draws: number,
 *   hits: number}} Odds how likely chance is to satisfy the wish, with its 95 % interval; without a hit probability 0 */
/** @typedef {{verdict: "common"|"rare"|"nothing-yet", one_in: number|null, at_least: number, draws: number,
 *   hits: number, seconds: number}} Difficulty what a first look at draws of the prior found; `at_least` is 1 / high
 *   of the 95 % interval */
/** @typedef {{id: string, world: string, world_version: number, title: string, model: object,
 *   constraints: Constraint[], wishes: string[], created_at: string, samples: number, chains: ChainCounts, odds: Odds|null,
 *   difficulty: Difficulty|null}} Scenario */
/** @typedef {{name: string, kind: "number"|"integer"|"flag"|"set"|"list", unit: string, summary: string,
 *   of?: "number"|"integer"|"flag"}} MeasureMeaning `of` is the kind of a list's members */
/** @typedef {{measures: MeasureMeaning[], variable_units: Object<string, string>}} Meaning of a scenario's numbers; a
 *   variable's name has "#" for its numbers */
/** @typedef {{name: string, version: number, summary: string, try: string, default_method: string, methods?: string[],
 *   model: object, measures: MeasureMeaning[],
 *   constraints: {kind: string, summary: string, schema: object}[], examples: object[]}} World */
/** @typedef {{id: string, scenario: string, index: number, seed: number, method: string, ratios: string,
 *   state: "queued"|"running"|"paused"|"finished"|"failed", iteration: number, accepted: number, samples: number,
 *   simulations: number, simulated_seconds: number, iterations_per_second: number,
 *   kernels: {name: string, proposed: number, accepted: number}[],
 *   first_sample: {iteration: number, seconds: number}|null, phase: "exploring"|"sampling",
 *   lesson: number, counted: number, skipped_seconds: number, effective_samples: number|null, ended_by: string|null, error?: string,
 *   guided?: boolean}} Chain guided: its world shows it the way;
 *   lesson: that it began from, 0 for none; counted: samples that count */
/** @typedef {{name: string, unit: string, rhat: number|null, ess_bulk: number|null, ess_tail: number|null,
 *   ess_within: number|null, ess_across: number|null, mean: number|null, sd: number|null}} Quantity effective sample
 *   sizes over all chains together, within each chain by itself (summed), and from the spread of the chains' means */
/** @typedef {{chain: string, low: number, high: number, proposed: number, accepted: number}} Swap between two
 *   neighbours of a ladder, at inverse temperatures `low` and `high` */
/** @typedef {{quantities: Quantity[], quantity_count: number, chains: number, draws_per_chain: number,
 *   effective: {samples: number, quantity: string, within: number, per_cpu_minute: number|null}|null, odds: Odds|null,
 *   first_sample: {seconds: number}|null, eta_seconds: number|null,
 *   saved: {iterations: number, simulations: number, simulated_seconds: number, skipped_seconds: number,
 *   share: number|null}, swaps: Swap[]}} Diagnostics */
/** @typedef {number|boolean|number[]|null} Measure null where there is none */
/** @typedef {{id: string, scenario: string, chain: string, iteration: number, weight: number, log_prior: number,
 *   log_constraint: number, duration: number, measures: Object<string, Measure>, digest: string,
 *   plays: number, created_at: string, learning: boolean, variables?: Object<string, number|null>}} Sample */
/** @typedef {{type: "sphere", radius: number} | {type: "box", half_extents: number[]}
 *   | {type: "cylinder", radius: number, height: number} | {type: "revolution", profile: number[][]}
 *   | {type: "mesh", positions: number[], indices: number[], attributes?: Object<string, number[]>}} Shape attributes
 *   have a value for each vertex */
/** @typedef {{name: string, shape: Shape, color: string, surface?: string, track?: number, position?: number[],
 *   rotation?: number[]}} Body */
/** @typedef {{time: number, kind: string, bodies: string[], impulse: number, position?: number[],
 *   normal?: number[]}} KeyframeEvent where, and the direction in which the first body is pushed */
/** @typedef {{center: number[], half_extents: number[], azimuth: number, elevation: number}} Viewpoint the box to
 *   see first, and from where */
/** @typedef {{format: string, sample: string, rate: number, frames: number, duration: number, bodies: Body[],
 *   tracks: {position: number[], rotation: number[], from?: number}[], events: KeyframeEvent[], view?: Viewpoint}} Keyframes */

export {};
