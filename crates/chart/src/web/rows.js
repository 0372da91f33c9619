// hpuRows(container, data) draws the rows of a table over two of its columns: as cells where they lie on a grid, as
// points elsewhere. The row under the pointer, or the one that arrows choose, is told with all its columns.
//
// data = {
//   columns: ["wall.stiffness", ...],
//   rows: [[0.5, "settled", ...], ...],  numbers and texts; null where a cell is empty
//   x, y, color: names of columns to begin with
//   about: { "wall.stiffness": "in N.m/rad", ... },  meanings of columns
// }
"use strict";

function hpuRows(container, data) {
  const { columns, rows } = data;
  const SPACE = "http://www.w3.org/2000/svg";
  const WIDE = 720, HIGH = 420, LEFT = 84, TOP = 12, RIGHT = 12, BOTTOM = 48;
  const COLORS = 8; // --row-1 to --row-8

  const make = (tag, parent, name) => {
    const element = document.createElement(tag);
    if (name) element.className = name;
    return parent.appendChild(element);
  };
  const draw = (tag, parent, attributes) => {
    const element = document.createElementNS(SPACE, tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    return parent.appendChild(element);
  };
  const meant = (at) => (data.about?.[columns[at]] ? `${columns[at]}: ${data.about[columns[at]]}` : columns[at]);
  const text = (value) => (typeof value === "number" ? String(Number(value.toPrecision(6))) : String(value ?? "–"));

  container.classList.add("hpu-rows");
  container.replaceChildren();
  const tools = make("div", container, "hpu-rows-tools"), legend = make("div", container, "hpu-rows-legend");
  const svg = draw("svg", container, {
    viewBox: `0 0 ${WIDE} ${HIGH}`, role: "img", tabindex: 0, "aria-keyshortcuts": "ArrowLeft ArrowRight",
  });
  const told = make("div", container, "hpu-rows-told");
  told.setAttribute("role", "status");
  told.textContent = "Point at a run, or move with the arrow keys, to see its figures.";

  const isNumber = (at) => {
    const given = rows.map((row) => row[at]).filter((value) => value !== null);
    return given.some((value) => value !== given[0]) && given.every((value) => typeof value === "number");
  };
  const numbers = columns.map((_, at) => at).filter(isNumber);
  if (numbers.length === 0 || rows.length < 2) { container.remove(); return; }
  const kinds = (at) => [...new Set(rows.map((row) => text(row[at])))];
  const texts = columns.map((_, at) => at).filter((at) => !numbers.includes(at) && kinds(at).length <= COLORS);
  const named = (name, among, other) => {
    const at = columns.indexOf(name);
    return among.includes(at) ? at : among[Math.min(other, among.length - 1)];
  };
  const chosen = { x: named(data.x, numbers, 0), y: named(data.y, numbers, 1), color: named(data.color, texts, 0) };
  const choice = (key, label, among) => {
    if (!among.length) return;
    const wrap = make("label", tools);
    wrap.textContent = `${label} `;
    const select = make("select", wrap);
    for (const at of among) {
      const option = make("option", select);
      option.value = at;
      option.textContent = columns[at];
    }
    select.value = chosen[key];
    select.onchange = () => { chosen[key] = Number(select.value); show(); };
  };
  choice("x", "across", numbers);
  choice("y", "up", numbers);
  choice("color", "colour", texts);

  let marks = [], order = [], at = -1;

  /** Returns a scale for a column: logarithmic where it spans more than a factor of 30, with zeros at its foot. */
  function scale(column, from, to) {
    const all = rows.map((row) => row[column]).filter((value) => value !== null && Number.isFinite(value));
    const high = Math.max(...all), above = all.filter((value) => value > 0), least = Math.min(...above);
    const log = all.every((value) => value >= 0) && above.length > all.length / 2 && high / least > 30;
    const low = log ? least : Math.min(...all);
    const f = log ? (value) => Math.log10(Math.max(value, least)) : (value) => value;
    const unique = [...new Set(all)].sort((one, other) => one - other);
    const steps = unique.slice(1).map((value, i) => f(value) - f(unique[i])).filter((step) => step > 0);
    const step = steps.length ? Math.min(...steps) : 1, half = (f(high) - f(low)) / (unique.length - 1 || 1) / 2 || 0.5;
    const start = f(low) - half, end = f(high) + half;
    const place = (value) => from + ((f(value) - start) / (end - start)) * (to - from);
    const fifth = (f(high) - f(low)) / 5, decade = 10 ** Math.floor(Math.log10(fifth || 1));
    const by = log ? Math.max(1, Math.round(fifth)) : [1, 2, 5, 10].map((m) => m * decade).find((s) => s >= fifth);
    const ticks = [];
    for (let n = Math.ceil(start / by); n <= end / by; n++) ticks.push(log ? 10 ** (n * by) : n * by);
    return { place, ticks, unique, size: (Math.abs(to - from) * step) / (end - start) };
  }

  function show() {
    svg.replaceChildren();
    legend.replaceChildren();
    const x = scale(chosen.x, LEFT, WIDE - RIGHT), y = scale(chosen.y, HIGH - BOTTOM, TOP);
    svg.setAttribute("aria-label", `${rows.length} runs: ${columns[chosen.y]} over ${columns[chosen.x]}`);
    for (const tick of x.ticks) {
      draw("path", svg, { class: "grid", d: `M${x.place(tick)},${TOP}V${HIGH - BOTTOM}` });
      draw("text", svg, { x: x.place(tick), y: HIGH - BOTTOM + 16, "text-anchor": "middle" }).textContent = text(tick);
    }
    for (const tick of y.ticks) {
      draw("path", svg, { class: "grid", d: `M${LEFT},${y.place(tick)}H${WIDE - RIGHT}` });
      draw("text", svg, { x: LEFT - 6, y: y.place(tick) + 4, "text-anchor": "end" }).textContent = text(tick);
    }
    draw("text", svg, { x: WIDE - RIGHT, y: HIGH - 8, "text-anchor": "end" }).textContent = meant(chosen.x);
    const upright = { x: 14, y: TOP, transform: `rotate(-90 14 ${TOP})`, "text-anchor": "end" };
    draw("text", svg, upright).textContent = meant(chosen.y);
    // Rows fill a grid where there is about one for each pair of values.
    const isGrid = rows.length >= 0.6 * x.unique.length * y.unique.length && x.unique.length > 1 && y.unique.length > 1;
    const names = chosen.color === undefined ? [] : kinds(chosen.color);
    names.forEach((name, i) => {
      const key = make("span", legend);
      make("span", key, "hpu-rows-swatch").style.background = `var(--row-${i + 1})`;
      key.append(name || "–");
    });
    marks = rows.map((row) => {
      const [px, py] = [x.place(row[chosen.x]), y.place(row[chosen.y])];
      if (!Number.isFinite(px) || !Number.isFinite(py) || row[chosen.x] === null || row[chosen.y] === null) return null;
      const fill = names.length ? `var(--row-${names.indexOf(text(row[chosen.color])) + 1})` : "var(--row-1)";
      const mark = isGrid
        ? draw("rect", svg, { x: px - x.size / 2, y: py - y.size / 2, width: x.size, height: y.size, class: "mark" })
        : draw("circle", svg, { cx: px, cy: py, r: 5, class: "mark" });
      mark.style.fill = fill;
      mark.onpointerenter = () => tell(rows.indexOf(row));
      mark.onclick = () => tell(rows.indexOf(row));
      return mark;
    });
    order = rows.map((_, i) => i).filter((i) => marks[i]);
    const apart = (one, other, column) => rows[one][column] - rows[other][column];
    order.sort((one, other) => apart(one, other, chosen.y) || apart(one, other, chosen.x));
    if (at >= 0) tell(at);
  }

  /** Tells a row: its figures, and its command last. */
  function tell(row) {
    marks.forEach((mark, i) => mark && mark.classList.toggle("chosen", i === row));
    if (marks[row]) svg.append(marks[row]);
    at = row;
    told.replaceChildren();
    const list = make("dl", told, "facts");
    columns.forEach((name, i) => {
      const value = rows[row][i];
      if (value === null || value === "") return;
      const head = make("dt", list);
      head.textContent = name;
      head.title = data.about?.[name] ?? "";
      make(name === "replay" ? "code" : "span", make("dd", list)).textContent = text(value);
    });
  }

  svg.addEventListener("keydown", (event) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!by) return;
    event.preventDefault();
    tell(order[(order.indexOf(at) + by + order.length) % order.length]);
  });
  show();
}
