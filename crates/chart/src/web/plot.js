// hpuPlot(container, data) draws time series that a reader zooms from a whole run down to single edges.
//
// data = {
//   x: Float64Array,                 times of the points, ascending
//   xUnit: "s",
//   series: [{ name, unit, step, values, x, hidden, doc }],
//                                    step: a value holds to the next point; else points are joined.
//                                    x: times of this series, where they differ from data.x
//                                    hidden: shown only when its key is pressed; doc: its meaning
//   markers: [{ x, label }],         upright lines
//   spans: [{ from, to, label }],    shaded ranges
//   onView(from, to),                called after a reader has zoomed or panned
// }
// Series of one unit share a panel; series of the unit "bit" are lanes of 0 and 1. Each column of pixels shows the
// least and the greatest value within it, so that no narrow pulse is lost at any zoom.
// Returns { set(data), view(from, to) }: other data in the same view, and another view in `xUnit`.
// Wheel, drag, pinch, + - arrows and Home zoom and pan; Shift with an arrow moves the cursor. Needs plot.css.
"use strict";

function hpuPlot(container, data) {
  const BLOCK = 256; // values of one summary
  const PANEL = 150, LANE = 24, TOP = 26, BOTTOM = 34, GAP = 10; // pixels
  const PAPER = 700; // pixels of the width of a page
  const COLORS = 6; // --plot-1 to --plot-6
  const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];
  const SCALED = /^(s|m|rad|N|N·m|N\.m|A|V|J|W|Hz|m\/s|rad\/s|N\/m)$/;

  const make = (tag, name, parent) => {
    const element = document.createElement(tag);
    element.className = name;
    return parent.appendChild(element);
  };
  container.classList.add("hpu-plot");
  container.replaceChildren();
  const legend = make("div", "hpu-plot-legend", container);
  const canvas = make("canvas", "hpu-plot-canvas", container);
  const spoken = make("div", "hpu-plot-spoken", container);
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-keyshortcuts", "+ - ArrowLeft ArrowRight Home Shift+ArrowLeft Shift+ArrowRight");
  spoken.setAttribute("role", "status");
  const context = canvas.getContext("2d");

  let series = [], panels = [], whole = [0, 1], shown = null, cursor = null, area = null, waiting = false;

  // --- Numbers ------------------------------------------------------------------------------------------------------

  /** Returns the factor and the sign of the prefix for a magnitude. */
  function prefix(magnitude, unit) {
    if (!SCALED.test(unit) || !(magnitude > 0)) return [1, ""];
    return PREFIXES.find(([factor]) => magnitude >= factor * 0.9995) || PREFIXES[PREFIXES.length - 1];
  }

  function text(value, digits = 6) {
    if (!Number.isFinite(value)) return "–";
    const short = String(Number(value.toPrecision(digits)));
    return short.replace("-", "−");
  }

  /** Returns a value with its unit. */
  function quantity(value, unit) {
    if (unit === "bit") return text(value);
    const [factor, sign] = prefix(Math.abs(value), unit);
    return `${text(value / factor)} ${sign}${unit}`.trim();
  }

  /** Returns round values within a range, at most about `most`, and the number of decimals that tell them apart. */
  function ticks(from, to, most) {
    const least = (to - from) / most, decade = 10 ** Math.floor(Math.log10(least));
    const step = [1, 2, 5, 10].map((m) => m * decade).find((s) => s >= least * (1 - 1e-9));
    const all = [], last = Math.floor(to / step + 1e-9);
    for (let n = Math.ceil(from / step - 1e-9); n <= last; n++) all.push(n * step);
    return [all, Math.max(0, Math.ceil(-Math.log10(step) - 1e-9))];
  }

  /** Returns a number with so many decimals; zero has no sign. */
  const label = (value, decimals) =>
    value.toFixed(Math.min(decimals, 15)).replace(/^-(0\.?0*)$/, "$1").replace("-", "−");

  // --- Data ---------------------------------------------------------------------------------------------------------

  /** Returns the index of the first time that is not before t. */
  function first(x, t) {
    let low = 0, high = x.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (x[middle] < t) low = middle + 1; else high = middle;
    }
    return low;
  }

  /** Returns the value at a time: held, or between its neighbours. */
  function valueAt(one, t) {
    const { x, values } = one, after = first(x, t);
    if (after < x.length && x[after] === t) return values[after];
    if (after === 0) return NaN;
    if (one.step) return values[after - 1];
    if (after === x.length) return NaN;
    const share = (t - x[after - 1]) / (x[after] - x[after - 1]);
    return values[after - 1] + share * (values[after] - values[after - 1]);
  }

  /** Widens `range` by the values from index `from` up to `to`, by whole blocks where it can. */
  function widen(range, one, from, to) {
    const take = (low, high) => {
      if (low < range[0]) range[0] = low;
      if (high > range[1]) range[1] = high;
    };
    for (let i = from; i < to; i++) {
      if (i % BLOCK === 0 && i + BLOCK <= to) {
        take(one.lows[i / BLOCK], one.highs[i / BLOCK]);
        i += BLOCK - 1;
      } else {
        take(one.values[i], one.values[i]);
      }
    }
    return range;
  }

  /** Widens `range` by all that a series shows from one time to another. */
  function widenOver(range, one, from, to) {
    widen(range, one, first(one.x, from), first(one.x, to));
    for (const value of [valueAt(one, from), valueAt(one, to)]) {
      if (value < range[0]) range[0] = value;
      if (value > range[1]) range[1] = value;
    }
    return range;
  }

  function summarised(given, color) {
    const one = { step: false, unit: "", x: data.x, hidden: false, ...given, color };
    const blocks = Math.floor(one.values.length / BLOCK);
    one.lows = new Float64Array(blocks);
    one.highs = new Float64Array(blocks);
    for (let b = 0; b < blocks; b++) {
      let low = Infinity, high = -Infinity;
      for (let i = b * BLOCK; i < (b + 1) * BLOCK; i++) {
        const value = one.values[i];
        if (value < low) low = value;
        if (value > high) high = value;
      }
      one.lows[b] = low;
      one.highs[b] = high;
    }
    return one;
  }

  function set(next) {
    const hidden = new Map(series.map((one) => [one.name, one.hidden]));
    data = { xUnit: "s", markers: [], spans: [], ...next };
    // Series of one panel have colours one after the other.
    const among = (at) => data.series.slice(0, at).filter((one) => one.unit === data.series[at].unit).length;
    series = data.series.map((one, at) => summarised(one, among(at) % COLORS));
    series.forEach((one) => { one.hidden = hidden.get(one.name) ?? one.hidden; });
    const ends = series.filter((one) => one.x.length).map((one) => [one.x[0], one.x[one.x.length - 1]]);
    whole = [Math.min(...ends.map((end) => end[0])), Math.max(...ends.map((end) => end[1]))];
    if (!(whole[1] > whole[0])) whole = [whole[0] || 0, (whole[0] || 0) + 1];
    if (shown) keep(...shown);
    legends();
    layout();
  }

  // --- View ---------------------------------------------------------------------------------------------------------

  const now = () => shown || whole;
  /** Returns the cursor's time; null where it is not in view. */
  const seen = () => (cursor !== null && cursor >= now()[0] && cursor <= now()[1] ? cursor : null);

  /** Sets the view; it stays within the data, and is not finer than their floating-point numbers. */
  function keep(from, to) {
    const least = Math.max(1e-13 * (whole[1] - whole[0]), 1e-15 * Math.max(...whole.map(Math.abs)), 1e-300) * 1e3;
    const span = Math.max(to - from, least);
    if (span >= whole[1] - whole[0]) { shown = null; return; }
    const start = Math.min(Math.max((from + to - span) / 2, whole[0]), whole[1] - span);
    shown = [start, start + span];
  }

  function view(from, to) {
    keep(from, to);
    redraw();
    data.onView?.(...now());
  }

  function zoom(factor, at) {
    const [from, to] = now(), middle = at ?? seen() ?? (from + to) / 2;
    view(middle + (from - middle) * factor, middle + (to - middle) * factor);
  }

  function pan(share) {
    const [from, to] = now(), by = share * (to - from);
    const kept = Math.min(Math.max(by, whole[0] - from), whole[1] - to);
    view(from + kept, to + kept);
  }

  // --- Legend -------------------------------------------------------------------------------------------------------

  function legends() {
    legend.replaceChildren();
    for (const one of series) {
      const button = make("button", "hpu-plot-key", legend);
      button.type = "button";
      make("span", "hpu-plot-swatch", button).style.background = `var(--plot-${one.color + 1})`;
      make("span", "", button).textContent = one.name;
      one.output = make("span", "hpu-plot-value", button);
      const press = () => button.setAttribute("aria-pressed", String(!one.hidden));
      button.title = one.doc ? `${one.doc}. Press to show or hide.` : "Press to show or hide.";
      press();
      button.onclick = () => {
        one.hidden = !one.hidden;
        press();
        layout();
      };
    }
    const tools = make("span", "hpu-plot-tools", legend);
    const tool = (sign, name, act) => {
      const button = make("button", "hpu-plot-tool", tools);
      button.type = "button";
      button.textContent = sign;
      button.title = name;
      button.setAttribute("aria-label", name);
      button.onclick = act;
    };
    tool("+", "Zoom in", () => zoom(0.5));
    tool("−", "Zoom out", () => zoom(2));
    tool("⟷", "Show the whole run", () => view(...whole));
  }

  function tell() {
    for (const one of series) {
      const isTold = cursor !== null && !one.hidden;
      one.output.textContent = isTold ? quantity(valueAt(one, cursor), one.unit) : "";
    }
  }

  /** Says view and cursor to a screen reader, after a key. */
  function speak() {
    tell();
    const [from, to] = now().map((x) => quantity(x, data.xUnit));
    const values = series.filter((one) => !one.hidden).map((one) => `${one.name} ${one.output.textContent}`);
    const at = cursor === null ? "" : `. At ${quantity(cursor, data.xUnit)}: ${values.join(", ")}`;
    spoken.textContent = `${from} to ${to}${at}`;
  }

  // --- Drawing ------------------------------------------------------------------------------------------------------

  /** Puts the series that are shown into panels by their units. */
  function layout() {
    panels = [];
    for (const one of series.filter((each) => !each.hidden)) {
      let panel = panels.find((each) => each.unit === one.unit);
      if (!panel) panels.push((panel = { unit: one.unit, series: [] }));
      panel.series.push(one);
    }
    let top = TOP;
    for (const panel of panels) {
      panel.top = top;
      panel.height = panel.unit === "bit" ? LANE * panel.series.length : PANEL;
      top += panel.height + GAP;
    }
    canvas.style.height = `${Math.max(top, TOP + PANEL) + BOTTOM - GAP}px`;
    const names = series.map((one) => one.name).join(", ");
    canvas.setAttribute("aria-label", `Plot over time (${data.xUnit}): ${names}`);
    redraw();
  }

  function redraw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(draw);
  }

  function draw() {
    waiting = false;
    const style = getComputedStyle(container), ink = (name) => style.getPropertyValue(`--plot-${name}`).trim();
    const ratio = container.classList.contains("printing") ? 3 : window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = `12px ${style.fontFamily}`;
    const [from, to] = now();
    for (const panel of panels) scale(panel, from, to);
    const left = Math.ceil(Math.max(40, ...panels.map((panel) => panel.gutter)) + 8), right = width - 14;
    const bottom = height - BOTTOM;
    area = { left, right };
    const X = (t) => left + ((t - from) / (to - from)) * (right - left);
    const line = (x0, y0, x1, y1) => {
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x1, y1);
      context.stroke();
    };
    const write = (words, x, y, align, color) => {
      context.textAlign = align;
      context.fillStyle = color;
      context.fillText(words, x, y);
    };
    context.textBaseline = "middle";
    context.lineWidth = 1;

    let labelled = -Infinity; // Labels at the top do not cover each other.
    const above = (words, x) => {
      const room = context.measureText(words).width, at = Math.min(Math.max(x, left), right - room);
      if (at < labelled) return;
      write(words, at, TOP / 2, "left", ink("quiet"));
      labelled = at + room + 12;
    };
    const notes = data.spans.filter((span) => span.to > from && span.from < to).map((span) => {
      const x0 = Math.max(X(span.from), left), x1 = Math.min(X(span.to), right);
      context.fillStyle = ink("span");
      context.fillRect(x0, TOP, Math.max(x1 - x0, 1), bottom - TOP);
      return [x0 + 3, span.label];
    });

    const [times, unit, base, since] = timeTicks(from, to, Math.max(2, Math.floor((right - left) / 90)));
    context.strokeStyle = ink("grid");
    for (const [t, words] of times) {
      line(X(t), TOP, X(t), bottom);
      write(words, X(t), bottom + 11, "center", ink("quiet"));
    }
    write(base ? `${unit} after ${since} ${data.xUnit}` : unit, right, bottom + 25, "right", ink("quiet"));

    for (const panel of panels) {
      const { top, height: tall, low, high } = panel;
      if (panel.unit === "bit") {
        panel.series.forEach((one, lane) => {
          const foot = top + LANE * (lane + 1) - 5;
          write(one.name, left - 6, foot - 7, "right", ink("quiet"));
          curve(one, from, to, X, (value) => foot - (LANE - 10) * value, left, right, ratio, ink);
        });
        continue;
      }
      const Y = (value) => top + tall - ((value - low) / (high - low)) * tall;
      context.strokeStyle = ink("grid");
      for (const [value, words] of panel.ticks) {
        line(left, Y(value), right, Y(value));
        write(words, left - 6, Y(value), "right", ink("quiet"));
      }
      panel.series.forEach((one) => curve(one, from, to, X, Y, left, right, ratio, ink));
      context.fillStyle = ink("paper");
      context.fillRect(left + 1, top + 1, context.measureText(panel.title).width + 8, 16);
      write(panel.title, left + 5, top + 9, "left", ink("ink"));
      context.strokeStyle = ink("axis");
      context.strokeRect(left + 0.5, top + 0.5, right - left - 1, tall - 1);
    }

    context.setLineDash([4, 3]);
    context.strokeStyle = ink("marker");
    for (const marker of data.markers.filter((each) => each.x >= from && each.x <= to)) {
      line(X(marker.x), TOP, X(marker.x), bottom);
      notes.push([X(marker.x), marker.label]);
    }
    context.setLineDash([]);
    notes.sort((one, other) => one[0] - other[0]).forEach(([x, words]) => above(words, x));
    if (seen() !== null) {
      context.strokeStyle = ink("ink");
      line(X(cursor), TOP, X(cursor), bottom);
      const words = base ? `${text((cursor - base) / prefix(to - from, data.xUnit)[0], 6)} ${unit}` : "";
      write(words || quantity(cursor, data.xUnit), left, bottom + 25, "left", ink("ink"));
    }
    tell();
  }

  /** Returns the ticks of the times; within a short view they count from a round time before it. */
  function timeTicks(from, to, most) {
    const span = to - from, [factor, sign] = prefix(span, data.xUnit), unit = sign + data.xUnit;
    const step = 10 ** Math.ceil(Math.log10(span));
    const base = span < 2e-3 * Math.max(Math.abs(from), Math.abs(to)) ? Math.floor(from / step) * step : 0;
    const [all, decimals] = ticks((from - base) / factor, (to - base) / factor, most);
    const since = label(base, Math.max(0, Math.round(-Math.log10(step))));
    return [all.map((t) => [t * factor + base, label(t, decimals)]), unit, base, since];
  }

  /** Finds a panel's range of values in the view, its ticks, and the room for their labels. */
  function scale(panel, from, to) {
    panel.gutter = 0;
    const measure = (words) => { panel.gutter = Math.max(panel.gutter, context.measureText(words).width); };
    if (panel.unit === "bit") {
      panel.series.forEach((one) => measure(one.name));
      return;
    }
    let [low, high] = panel.series.reduce((range, one) => widenOver(range, one, from, to), [Infinity, -Infinity]);
    if (!(low <= high)) [low, high] = [-1, 1];
    const room = high > low ? 0.08 * (high - low) : Math.abs(high) * 0.05 || 1;
    panel.low = low - room;
    panel.high = high + room;
    const [factor, sign] = prefix(Math.max(Math.abs(panel.low), Math.abs(panel.high)), panel.unit);
    const [all, decimals] = ticks(panel.low / factor, panel.high / factor, 6);
    panel.ticks = all.map((value) => [value * factor, label(value, decimals)]);
    panel.ticks.forEach(([, words]) => measure(words));
    panel.title = sign + panel.unit;
  }

  /** Draws one series: each point where there is room for it, else the range of values of each column of pixels. */
  function curve(one, from, to, X, Y, left, right, ratio, ink) {
    const { x, values } = one, columns = Math.floor((right - left) * ratio);
    const start = Math.max(first(x, from) - 1, 0), end = Math.min(first(x, to) + 1, x.length);
    context.save();
    context.beginPath();
    context.rect(left, 0, right - left, canvas.clientHeight);
    context.clip();
    context.beginPath();
    context.strokeStyle = ink(one.color + 1);
    context.lineWidth = 1.5;
    context.lineJoin = "round";
    let drawing = false;
    const go = (px, py) => {
      if (Number.isNaN(py)) { drawing = false; return; }
      if (drawing) context.lineTo(px, py); else context.moveTo(px, py);
      drawing = true;
    };
    if (end - start <= 2 * columns) {
      for (let i = start; i < end; i++) {
        if (one.step && i > start) go(X(x[i]), Y(values[i - 1]));
        go(X(x[i]), Y(values[i]));
      }
      if (one.step && end === x.length && end > 0) go(X(Math.max(to, x[end - 1])), Y(values[end - 1]));
    } else {
      let index = first(x, from);
      for (let column = 0; column < columns; column++) {
        const time = (at) => from + (at / columns) * (to - from), next = first(x, time(column + 1));
        const range = widen([Infinity, -Infinity], one, index, next), entered = valueAt(one, time(column));
        const low = entered < range[0] ? entered : range[0], high = entered > range[1] ? entered : range[1];
        index = next;
        const px = left + (column + 0.5) / ratio;
        go(px, low <= high ? Y(column % 2 ? low : high) : NaN);
        if (low < high) go(px, Y(column % 2 ? high : low));
      }
    }
    context.stroke();
    context.restore();
  }

  // --- Hands --------------------------------------------------------------------------------------------------------

  const timeOf = (event) => {
    const [from, to] = now(), at = event.clientX - canvas.getBoundingClientRect().left;
    return from + ((at - area.left) / (area.right - area.left)) * (to - from);
  };
  const within = (t) => Math.min(Math.max(t, whole[0]), whole[1]);

  // A wheel that is scrolling the page goes on doing so when a plot comes under the pointer.
  let scrolled = -Infinity;
  addEventListener("wheel", (event) => {
    if (!container.contains(event.target)) scrolled = event.timeStamp;
  }, { passive: true });
  canvas.addEventListener("wheel", (event) => {
    const scrolls = event.timeStamp - scrolled < 400 || (!shown && event.deltaY > 0);
    if (!area || (scrolls && !event.ctrlKey)) { scrolled = event.timeStamp; return; }
    event.preventDefault();
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) pan(event.deltaX / 800);
    else zoom(Math.exp(Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 200) / 300), timeOf(event));
  }, { passive: false });

  const fingers = new Map(); // pointers that are down, with the times under them
  canvas.addEventListener("pointerdown", (event) => {
    if (!area || event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.clientX, t: timeOf(event) });
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!area) return;
    const finger = fingers.get(event.pointerId);
    cursor = within(timeOf(event));
    if (!finger) { redraw(); return; }
    finger.x = event.clientX;
    const [from, to] = now(), edge = canvas.getBoundingClientRect().left + area.left, wide = area.right - area.left;
    const [one, other] = [...fingers.values()];
    if (other && one.x !== other.x && one.t !== other.t) {
      const perPixel = (other.t - one.t) / (other.x - one.x);
      if (perPixel > 0) view(one.t - (one.x - edge) * perPixel, one.t + (wide - (one.x - edge)) * perPixel);
    } else {
      pan((finger.t - (from + ((finger.x - edge) / wide) * (to - from))) / (to - from));
    }
  });
  const lift = (event) => fingers.delete(event.pointerId);
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("pointerleave", () => { cursor = null; redraw(); });
  canvas.addEventListener("dblclick", () => view(...whole));

  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const right = event.key === "ArrowRight", [from, to] = now();
    if (event.key === "+" || event.key === "=" || event.key === "ArrowUp") zoom(0.5);
    else if (event.key === "-" || event.key === "ArrowDown") zoom(2);
    else if (event.key === "Home") view(...whole);
    else if (event.shiftKey && (right || event.key === "ArrowLeft")) {
      cursor = within((seen() ?? (from + to) / 2) + ((right ? 1 : -1) * (to - from)) / 100);
      redraw();
    } else if (right || event.key === "ArrowLeft") pan(right ? 0.2 : -0.2);
    else return;
    event.preventDefault();
    speak();
  });

  new ResizeObserver(redraw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  // On paper the plot has the colours of a light page, and the view that is shown.
  const print = (begins) => {
    container.classList.toggle("printing", begins);
    canvas.style.width = begins ? `${PAPER}px` : "";
    draw();
  };
  addEventListener("beforeprint", () => print(true));
  addEventListener("afterprint", () => print(false));

  set(data);
  return { set, view };
}
