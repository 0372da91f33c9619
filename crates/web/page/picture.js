// The picture of a run: position, effort with its ripple, and words. Zoomed in, it asks for a closer look.

/* global hpuPlot */

/** Rows of a closer look: more than the pixels of a wide screen. */
const ROWS = 3000;
/** Time without a further zoom after which a closer look is asked for, in ms. */
const SETTLING = 150;

/** Returns the times of rows. */
const timesOf = ({ first_s, interval_s, count }) =>
  Float64Array.from({ length: count }, (_, row) => first_s + row * interval_s);

/** Returns times and values that touch least and greatest value of each row: the curve fills the ripple's band. */
function band(x, least, greatest) {
  const times = new Float64Array(2 * x.length),
    values = new Float64Array(2 * x.length);
  for (let row = 0; row < x.length; row++) {
    times[2 * row] = row > 0 ? (x[row - 1] + x[row]) / 2 : x[row];
    times[2 * row + 1] = x[row];
    values[2 * row] = least[row];
    values[2 * row + 1] = greatest[row];
  }
  return { x: times, values };
}

/** Returns the series of an answer, with these nets. */
function seriesOf({ result, columns }, nets) {
  const x = timesOf(result.rows),
    all = result.columns.map((told, at) => ({ ...told, values: columns[at] }));
  const of = (role) => all.filter((column) => column.role === role);
  const drawn =
    (step) =>
    ({ label, unit, doc, values }) => ({ name: label, unit, doc, step, values, x });
  const plain = of("value").map(drawn(false));
  const motion = plain.filter(({ unit }) => unit === "rad" || unit === "m");
  const hand = plain.filter(({ name, unit }) => name.startsWith("hand") && unit.startsWith("N"));
  const [least, greatest, means] = ["least", "greatest", "mean"].map(of);
  const ripples = least.flatMap(({ label, unit }, at) => {
    const name = label.replace(" least", ""),
      doc = "Between the least and the greatest value of each row";
    const ripple = { name: `${name}, ripple`, unit, doc, step: false };
    return [
      { ...ripple, ...band(x, least[at].values, greatest[at].values) },
      { ...drawn(false)(means[at]), name: `${name}, mean` },
    ];
  });
  const words = of("net")
    .filter(({ name }) => nets.includes(name))
    .map(drawn(true));
  // A word without a unit has a panel of its own.
  const apart = words.map((one) => (one.unit === "1" ? { ...one, unit: one.name } : one));
  const series = [...motion, ...ripples, ...of("command").map(drawn(true)), ...hand, ...apart];
  return { x, series };
}

export class Picture {
  /** `look(from, to, rows)` returns a closer look, or null. */
  constructor(container, look) {
    this.container = container;
    this.look = look;
    this.plot = null;
    this.nets = [];
    this.whole = null;
    this.timer = 0;
    this.turn = 0;
  }

  /** Shows the answer of a run. */
  show(answer) {
    const { result } = answer,
      { x, series } = seriesOf(answer, this.nets);
    if (result.wall) {
      const ends = Float64Array.of(0, result.motion_s);
      const values = Float64Array.of(result.wall.position, result.wall.position);
      series.unshift({ name: "wall", unit: result.wall.unit, step: false, x: ends, values });
    }
    this.whole = {
      x,
      xUnit: "s",
      series,
      markers: result.faults.slice(0, 50).map(({ kind, at_s }) => ({ x: at_s, label: kind })),
      spans: [{ from: result.window_s[0], to: result.window_s[1], label: "judged" }],
      onView: (from, to) => this.viewed(from, to),
    };
    this.draw(this.whole);
    if (this.view) this.viewed(...this.view);
  }

  draw(data) {
    this.shown = data;
    if (this.plot) this.plot.set(data);
    else this.plot = hpuPlot(this.container, data);
  }

  /** Asks for a closer look when the view has rested. */
  viewed(from, to) {
    const { x } = this.whole,
      span = x[x.length - 1] - x[0];
    this.view = to - from < 0.999 * span ? [from, to] : null;
    clearTimeout(this.timer);
    const turn = ++this.turn;
    if (!this.view) {
      this.draw(this.whole);
      return;
    }
    this.timer = setTimeout(async () => {
      // A little more than the view, so that a short pan shows no gap.
      const more = 0.25 * (to - from);
      const answer = await this.look(Math.max(from - more, 0), to + more, ROWS);
      if (answer && turn === this.turn && answer.result.rows.count > 1) this.closer(answer);
    }, SETTLING);
  }

  /** Puts a closer look into the whole run. */
  closer(answer) {
    const near = seriesOf(answer, this.nets).series;
    // A mean is over whole periods of the modulator: between two of them it is that of the whole run.
    const isMean = ({ name }) => name.endsWith(", mean");
    const series = this.whole.series.map((one) => {
      const detail = near.find(({ name }) => name === one.name);
      return detail && !isMean(one) ? joined(one, detail) : one;
    });
    for (const detail of near.filter((one) => one.name.endsWith(", ripple"))) {
      if (!series.some(({ name }) => name === detail.name)) series.push(detail);
    }
    this.draw({ ...this.whole, series });
  }
}

/** Returns a series in which the times of `near` have its values. */
function joined(whole, near) {
  const from = near.x[0],
    to = near.x[near.x.length - 1];
  const before = whole.x.findIndex((t) => t >= from),
    after = whole.x.findIndex((t) => t > to);
  const [head, tail] = [before < 0 ? whole.x.length : before, after < 0 ? whole.x.length : after];
  const join = (a, b) => {
    const all = new Float64Array(head + b.length + a.length - tail);
    all.set(a.subarray(0, head));
    all.set(b, head);
    all.set(a.subarray(tail), head + b.length);
    return all;
  };
  return { ...whole, x: join(whole.x, near.x), values: join(whole.values, near.values) };
}
