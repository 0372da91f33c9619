// A stability map: the outcome of a scene over two of its keys. Workers fill it cell by cell, along boundaries alone as
// `hpu map` does; a click into a cell loads it.

import { Cancelled, Engine } from "./engine.js";
import { digits, find, make, short } from "./dom.js";

/** Class names of cells: their signs, so that a class is told without colours, and their words. */
const CLASSES = {
  settled: ["·", "settled"],
  passive: ["·", "passive"],
  tracking: ["·", "tracking"],
  limit_cycle: ["~", "limit cycle"],
  diverged: ["×", "diverged"],
  highly_unstable: ["×", "highly unstable"],
  non_passive: ["~", "non-passive"],
  not_told: ["?", "not told: a longer run would tell"],
  hand_moves: ["→", "the hand moves nearly to the end"],
  no_wall_torque: ["0", "no wall torque"],
  position_lost: ["w", "position lost: the counter has wrapped"],
  wall_not_reached: ["○", "wall not reached"],
  failed: ["!", "cannot be run"],
};

/** Returns the text of an axis around a value: five times down and up. */
export function axisAround({ key, value, takes }, cells) {
  const unit = takes.unit ? ` ${takes.unit}` : "";
  if (takes.kind === "whole") {
    const from = Math.max(takes.least, value - (cells - 1)),
      to = Math.min(takes.most, from + cells - 1);
    return `${key}=${from}..${to}:${to - from + 1}`;
  }
  if (!(value > 0)) return null;
  const [from, to] = [Math.max(value / 5, takes.least), Math.min(value * 5, takes.most)];
  return `${key}=${digits(from)}..${digits(to)}${unit}:${cells}:log`;
}

export class StabilityMap {
  /** `load(texts)` is called with the overrides of a cell that was chosen. */
  constructor(module, load) {
    this.engines = [new Engine(module), new Engine(module)];
    this.load = load;
    this.turn = 0;
  }

  stop() {
    this.turn += 1;
    this.engines.forEach((engine) => engine.end());
  }

  /** Fills the map of a request with `scene`, `set`, `x` and `y`; rejects with a Refusal. */
  async fill(request) {
    this.stop();
    const turn = this.turn,
      status = find("map-status"),
      begun = performance.now();
    const { result: axes } = await this.engines[0].ask({ do: "map", ...request });
    const columns = axes.x.values.length,
      rows = axes.y.values.length,
      count = columns * rows;
    this.axes = axes;
    this.classes = new Array(count).fill(null);
    this.grid(columns, rows);
    let done = 0;
    for (;;) {
      const plan = await this.engines[0].ask({ do: "plan", columns, rows, classes: this.classes });
      const { wanted, inferred } = plan.result;
      for (const [cell, like] of inferred) this.tell(cell, this.classes[like], "inferred from its neighbours");
      if (!wanted.length) break;
      const one = async (engine) => {
        for (let cell = wanted.shift(); cell !== undefined; cell = wanted.shift()) {
          const { result } = await engine.ask({ do: "cell", cell, ...request });
          if (turn !== this.turn) throw new Cancelled("stopped");
          this.classes[cell] = result.class;
          this.tell(cell, result.class, result.said);
          done += 1;
          status.textContent = `${done} cells run, ${count} in all`;
        }
      };
      await Promise.all(this.engines.map(one));
    }
    const seconds = (performance.now() - begun) / 1000;
    status.textContent = `${done} of ${count} cells run in ${digits(seconds, 2)} s; the others are inferred`;
    find("map").dataset.seconds = seconds;
  }

  /** Makes the empty grid. One cell can be reached by Tab; arrows move from it. */
  grid(columns, rows) {
    const { x, y } = this.axes,
      grid = find("map-grid");
    grid.style.setProperty("--columns", columns);
    grid.setAttribute("aria-label", `${y.key} over ${x.key}`);
    this.cells = new Array(columns * rows);
    const lines = [];
    for (let iy = rows - 1; iy >= 0; iy--) {
      const line = make(
        "div",
        { role: "row", className: "map-row" },
        make("span", { role: "rowheader", className: "map-label", title: y.texts[iy] }, short(y.values[iy])),
      );
      for (let ix = 0; ix < columns; ix++) {
        const index = iy * columns + ix;
        const cell = make("button", {
          type: "button",
          role: "gridcell",
          className: "cell",
          tabIndex: index === 0 ? 0 : -1,
          "aria-label": `${x.texts[ix]}, ${y.texts[iy]}: not run yet`,
          onclick: () => this.load([`${x.key}=${x.texts[ix]}`, `${y.key}=${y.texts[iy]}`]),
        });
        cell.addEventListener("keydown", (event) => this.move(event, index, columns, rows));
        this.cells[index] = cell;
        line.append(cell);
      }
      lines.push(line);
    }
    const ends = make(
      "div",
      { className: "map-ends" },
      make("span", {}, short(x.values[0])),
      make("span", {}, x.unit ? `${x.key} in ${x.unit}` : x.key),
      make("span", {}, short(x.values[columns - 1])),
    );
    grid.replaceChildren(...lines, ends);
    find("map-y").textContent = y.unit ? `${y.key} in ${y.unit}` : y.key;
    find("map-legend").replaceChildren();
  }

  move(event, index, columns, rows) {
    const by = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: columns, ArrowDown: -columns }[event.key];
    if (!by) return;
    event.preventDefault();
    const next = index + by,
      wraps = Math.abs(by) === 1 && Math.floor(next / columns) !== Math.floor(index / columns);
    if (next < 0 || next >= columns * rows || wraps) return;
    this.cells[index].tabIndex = -1;
    this.cells[next].tabIndex = 0;
    this.cells[next].focus();
  }

  /** Shows the class of a cell. */
  tell(index, name, said) {
    const { x, y } = this.axes,
      columns = x.values.length,
      cell = this.cells[index];
    const [sign, words] = CLASSES[name] || ["?", name];
    cell.dataset.class = name;
    cell.textContent = sign;
    const place = `${x.texts[index % columns]}, ${y.texts[Math.floor(index / columns)]}`;
    cell.title = `${place}: ${words}${said ? ` (${said})` : ""}`;
    cell.setAttribute("aria-label", cell.title);
    const legend = find("map-legend");
    if (![...legend.children].some((key) => key.dataset.class === name)) {
      legend.append(
        make(
          "span",
          { className: "key", "data-class": name },
          make("b", { className: "cell", "data-class": name }, sign),
          ` ${words}`,
        ),
      );
    }
  }
}
