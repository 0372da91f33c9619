// The page: its state is a scene and overrides; each change runs the scene, shows the result and becomes the permalink.

import { Cancelled, Engine, Refusal, compiled } from "./engine.js";
import { Controls } from "./controls.js";
import { Picture } from "./picture.js";
import { StabilityMap, axisAround } from "./map.js";
import { digits, find, make } from "./dom.js";
import { linkOf, stateOf } from "./link.js";

/** The scene of a page that names none. */
const FIRST_SCENE = "hybrid-wall";
/** A run that takes longer is ended when its scene has changed, in ms. */
const PATIENCE = 700;
/** Rows of the picture of a whole run with the ripple: some for each pixel. */
const WHOLE_ROWS = 2000;
/** A ripple that comes within this time after the run is drawn together with it, in ms. */
const TOGETHER = 30;
/** A picture with the ripple that comes later than this after the run does not hold up the next change, in ms. */
const RIPPLE = 150;
/** Time after which a run can be cancelled, in ms. */
const LONG = 400;

/** A wall that an encoder of 1024 lines holds just so, and the same wall with one bit less of position. */
const TOUR_SCENE = "conventional-wall-10khz";
const TOUR = [
  { label: "1. A wall that holds", set: { "wall.stiffness": "2.78 N.m/rad" } },
  { label: "2. One bit less in its encoder", set: { "wall.stiffness": "2.78 N.m/rad", "encoder.lines": "512" } },
];

const start = JSON.parse(find("start").textContent);
const own = start.scene?.text ? start.scene : null;

let state = { scene: FIRST_SCENE, set: {} };
let base = [],
  methods = [];
let module, engine, looker, map, picture, controls;
let running = null,
  again = 0,
  replaced = false,
  rebuild = true;
let nets = ["penetration"];

const sceneOf = () => (own && state.scene === own.name ? own : state.scene);
const texts = (set) => Object.entries(set).map(([key, value]) => `${key}=${value}`);
const request = () => ({ scene: sceneOf(), set: texts(state.set), nets });

function banner(message) {
  find("banner").textContent = message;
  find("banner").hidden = !message;
}

// --- Runs -----------------------------------------------------------------------------------------------------------

/** Runs the present scene; a run that is under way is left to end, unless it takes long. */
async function run(changed = performance.now()) {
  if (running) {
    again = changed;
    if (performance.now() - running > PATIENCE) engine.end();
    return;
  }
  looker.drop();
  running = performance.now();
  document.body.dataset.state = "running";
  const late = setTimeout(() => {
    find("cancel").hidden = false;
    find("busy").textContent = "running…";
  }, LONG);
  const asked = request();
  let rippled = false;
  try {
    // On another core, the same run with the ripple of its effort.
    const seen = whole(asked);
    const answer = await engine.ask({ do: "run", ...asked });
    const soon = await Promise.race([seen, after(TOGETHER, null)]);
    show(answer, soon);
    await drawn();
    document.body.dataset.milliseconds = performance.now() - changed;
    if (soon) document.body.dataset.rippled = document.body.dataset.milliseconds;
    const later = soon ? true : ripple(answer, seen, changed);
    if (rebuild) await controlsOf();
    rippled = await Promise.race([later, after(RIPPLE, false)]);
  } catch (error) {
    if (error instanceof Refusal) refuse(error);
    else if (!(error instanceof Cancelled)) throw error;
    else if (!again && !replaced)
      refuse({ errors: [{ key: "", message: "The run was cancelled; the picture is of the run before." }] });
  } finally {
    clearTimeout(late);
    running = null;
    replaced = false;
    find("cancel").hidden = true;
    find("busy").textContent = "";
    document.body.dataset.state = rippled ? "rippled" : "idle";
  }
  if (again) {
    const next = again;
    again = 0;
    run(next);
  }
}

const drawn = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));

/** Returns a value after a time in ms. */
const after = (time, value) => new Promise((done) => setTimeout(done, time, value));

/** Returns the answer of a run with the rows of a look that has its ripple; the answer itself without one. */
function withRipple(answer, seen) {
  if (!seen) return answer;
  const { rows, columns } = seen.result;
  return { columns: seen.columns, result: { ...answer.result, rows, columns } };
}

/** Returns the whole run with the ripple of its effort; null for one that was cancelled or is refused. */
async function whole(asked) {
  const refused = (error) => {
    if (error instanceof Refusal) return null;
    throw error;
  };
  try {
    // A scene without a clock has no closer look: its own rows are all there is.
    return (
      (await looker.ask({ do: "look", from_s: 0, to_s: 1e9, rows: WHOLE_ROWS, ...asked }).catch(refused)) ??
      (await looker.ask({ do: "run", ripple: true, ...asked }).catch(refused))
    );
  } catch (error) {
    if (error instanceof Cancelled) return null;
    throw error;
  }
}

/** Puts the ripple into the picture of a run; returns whether there is one. */
async function ripple(answer, coming, changed) {
  const seen = await coming;
  if (!seen) return false;
  picture.show(withRipple(answer, seen));
  await drawn();
  document.body.dataset.rippled = performance.now() - changed;
  if (!running) document.body.dataset.state = "rippled";
  return true;
}

/** Returns a closer look; null for a scene that has none. */
async function look(from_s, to_s, rows) {
  try {
    const answer = await looker.ask({ do: "look", from_s, to_s, rows, ...request() });
    document.body.dataset.looked = answer.result.rows.interval_s;
    return answer;
  } catch (error) {
    if (error instanceof Refusal || error instanceof Cancelled) return null;
    throw error;
  }
}

/** Shows the answer of a run, with the ripple of a look if that has come. */
function show(answer, seen) {
  const { result } = answer,
    verdict = find("verdict");
  controls.showErrors([]);
  find("errors").replaceChildren();
  find("results").classList.remove("stale");
  verdict.textContent = result.outcome;
  verdict.dataset.kind = result.verdict?.kind ?? "none";
  find("contact").textContent = result.contact ? `Contact: ${result.contact}` : "";
  find("energy").textContent = `Energy: ${result.energy_text}`;
  const missed =
    result.missed === null
      ? ""
      : `; the word of the stiffness misses what is asked for by ${digits(100 * result.missed, 3)} %`;
  find("work").textContent =
    `${result.closed_by} at ${digits(result.clock_hz / 1e6)} MHz: ${result.edges} clock cycles, ` +
    `${digits(result.motion_s)} s of motion, ${result.encoder_edges} encoder edges${missed}` +
    (result.aborted ? `; ended ${result.aborted}` : "");
  find("command").textContent = result.command;
  find("about").textContent = result.about;
  const drawn = result.device && new DOMParser().parseFromString(result.device, "image/svg+xml").documentElement;
  find("device").replaceChildren(...(drawn ? [drawn] : []));
  signals(result.nets);
  picture.nets = nets;
  picture.show(withRipple(answer, seen));
}

function refuse({ errors }) {
  const left = controls.showErrors(errors);
  find("results").classList.add("stale");
  find("errors").replaceChildren(
    ...left.map(({ key, message }) => {
      const line = make("li", {}, message);
      if (key in state.set)
        line.append(" ", make("button", { type: "button", onclick: () => change(key, null) }, `Remove ${key}`));
      return line;
    }),
  );
}

function signals(all) {
  const row = ({ name, doc, format, seen, range, unit, idle_bits, rounded, overflowed, width }) => {
    const box = make("input", { type: "checkbox", checked: nets.includes(name), "aria-label": `Draw ${name}` });
    box.onchange = () => {
      nets = box.checked ? [...nets, name] : nets.filter((net) => net !== name);
      run();
    };
    const used = seen ? Math.max(...seen.map((end, at) => (range[at] ? end / range[at] : 0))) : 0;
    const meter = make("meter", {
      min: 0,
      max: 1,
      value: used,
      title: `${digits(100 * used, 3)} % of its range`,
      "aria-label": `${name} uses ${digits(100 * used, 3)} % of its range`,
    });
    const cells = [
      box,
      make("span", { title: doc }, name),
      format,
      seen ? digits(seen[0], 6) : "–",
      seen ? digits(seen[1], 6) : "–",
      unit,
      width > 1 ? meter : "",
      idle_bits ?? "–",
      rounded,
    ];
    const line = make("tr", {}, ...cells.map((cell) => make("td", {}, cell)));
    line.append(make("td", { className: overflowed ? "lost" : "" }, overflowed));
    return line;
  };
  const body = find("signals").tBodies[0],
    focused = document.activeElement?.getAttribute("aria-label");
  // Words stand before single bits.
  body.replaceChildren(...[...all].sort((one, other) => (other.width > 1) - (one.width > 1)).map(row));
  if (focused?.startsWith("Draw ")) body.querySelector(`[aria-label="${focused}"]`)?.focus();
}

// --- State ----------------------------------------------------------------------------------------------------------

function linked() {
  const link = linkOf(state);
  try {
    history.replaceState(null, "", link);
  } catch {
    location.hash = link;
  }
  find("reset-all").hidden = Object.keys(state.set).length === 0;
}

/** Sets an override, or removes it. */
function change(key, text) {
  if (text === null) delete state.set[key];
  else state.set[key] = text;
  const kind = base.find((one) => one.key === key)?.takes.kind;
  rebuild ||= !["quantity", "whole", "format"].includes(kind);
  linked();
  run();
}

/** Makes the controls of the present scene, with the values of its overrides. */
async function controlsOf() {
  const { result } = await engine.ask({ do: "keys", ...request() });
  rebuild = false;
  controls.build(result.keys, base, state.set);
  const [across, up] = axes(result.keys);
  if (find("map").dataset.scene !== state.scene) {
    find("map").dataset.scene = state.scene;
    find("map-x-key").value = across;
    find("map-y-key").value = up;
    find("map-duration").value = "1 s";
  }
}

/** Returns the axes of a first map: a stiffness, and a damping, a rate or a mass. */
function axes(keys) {
  const around = (names, cells) =>
    keys
      .filter(({ key, value }) => names.test(key) && typeof value === "number")
      .map((key) => axisAround(key, cells))
      .find(Boolean) || "";
  const up = around(/^wall\.damping$/, 11) || around(/damping$|sample_rate$|frequency$|mass$/, 11);
  return [around(/^wall\.stiffness$/, 21) || around(/stiffness$/, 21), up];
}

/** Begins with another scene. */
async function begin(scene, set) {
  state = { scene, set };
  // A run of the scene before may take long, and nobody waits for it.
  replaced = running !== null;
  if (replaced) engine.end();
  let keys;
  try {
    keys = (await engine.ask({ do: "keys", scene: sceneOf(), set: [] })).result;
  } catch (error) {
    if (!(error instanceof Refusal) || scene === FIRST_SCENE) throw error;
    banner(`${error.message}\nShown is ${FIRST_SCENE} in its place.`);
    return begin(FIRST_SCENE, {});
  }
  base = keys.keys;
  methods = keys.methods;
  find("scene").value = scene;
  find("about").textContent = keys.about;
  find("method").replaceChildren(
    make("option", { value: "" }, "as in the scene"),
    ...methods.map(({ label }, at) => make("option", { value: at }, label)),
  );
  find("method").disabled = methods.length === 0;
  controls.build(base, base, set);
  picture.view = null;
  rebuild = true;
  linked();
  return run();
}

/** Tells a newcomer what to try: each step is a scene with overrides. */
function tour() {
  find("hint").replaceChildren(
    "Make a wall ring by taking away one bit: ",
    ...TOUR.map(({ label, set }) =>
      make("button", { type: "button", onclick: () => begin(TOUR_SCENE, { ...set }) }, label),
    ),
  );
}

/** Takes another method: the overrides of the one before go. */
function methodChosen() {
  for (const { set } of methods) for (const text of set) delete state.set[text.slice(0, text.indexOf("="))];
  const chosen = methods[find("method").value];
  for (const text of chosen?.set ?? []) state.set[text.slice(0, text.indexOf("="))] = text.slice(text.indexOf("=") + 1);
  rebuild = true;
  linked();
  run();
}

/** Gives the bytes of a waveform to the browser to save. */
async function save(format) {
  try {
    const { result, file } = await looker.ask({ do: "wave", format, ...request() });
    const place = URL.createObjectURL(new Blob([file], { type: "application/octet-stream" }));
    make("a", { href: place, download: result.name }).click();
    setTimeout(() => URL.revokeObjectURL(place), 10_000);
  } catch (error) {
    if (error instanceof Refusal) refuse(error);
    else if (!(error instanceof Cancelled)) throw error;
  }
}

async function fill() {
  const duration = find("map-duration").value.trim();
  const set = { ...state.set, ...(duration ? { "run.duration": duration } : {}) };
  find("map-error").textContent = "";
  find("map-stop").hidden = false;
  try {
    await map.fill({ scene: sceneOf(), set: texts(set), x: find("map-x-key").value, y: find("map-y-key").value });
  } catch (error) {
    if (error instanceof Refusal) find("map-error").textContent = error.message;
    else if (!(error instanceof Cancelled)) throw error;
  } finally {
    find("map-stop").hidden = true;
  }
}

async function copied(button, text) {
  const word = button.textContent;
  try {
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
  } catch {
    button.textContent = "Not allowed";
  }
  setTimeout(() => {
    button.textContent = word;
  }, 1200);
}

// --- Begin ----------------------------------------------------------------------------------------------------------

async function main() {
  if (typeof WebAssembly !== "object" || typeof DecompressionStream !== "function" || typeof Worker !== "function") {
    banner(
      "This browser has no WebAssembly, no workers or no DecompressionStream, so the loop cannot run here. " +
        "Any browser of 2023 or later has them; `hpu run` needs none.",
    );
    return;
  }
  module = await compiled(find("module").textContent);
  find("module").remove();
  engine = new Engine(module);
  looker = new Engine(module);
  controls = new Controls(change);
  picture = new Picture(find("picture"), look);
  map = new StabilityMap(module, (set) => {
    for (const text of set) state.set[text.slice(0, text.indexOf("="))] = text.slice(text.indexOf("=") + 1);
    controls.show(state.set);
    linked();
    run();
    find("outcome").scrollIntoView({ block: "nearest" });
  });
  const { result } = await engine.ask({ do: "scenes" });
  const names = [...(own ? [own.name] : []), ...result.scenes.map(({ name }) => name)];
  find("scene").replaceChildren(...names.map((name) => make("option", {}, name)));
  find("scene").onchange = () => {
    banner("");
    begin(find("scene").value, {});
  };
  find("method").onchange = methodChosen;
  find("reset-all").onclick = () => {
    find("method").value = "";
    begin(state.scene, {});
  };
  find("cancel").onclick = () => {
    again = 0;
    engine.end();
  };
  find("copy").onclick = () => copied(find("copy"), find("command").textContent);
  find("copy-link").onclick = () => copied(find("copy-link"), location.href);
  find("save-fst").onclick = () => save("fst");
  find("save-vcd").onclick = () => save("vcd");
  find("map-fill").onclick = fill;
  find("map-stop").onclick = () => map.stop();
  tour();
  onhashchange = fromLink;
  // For the console, and for tests: further engines, and the picture with its numbers.
  globalThis.hpuExplorer = { engine: () => new Engine(module), picture };
  await fromLink();
}

/** Takes the state of the permalink, or that which the page was written with. */
async function fromLink() {
  const { state: linkedState, ignored } = stateOf(location.hash);
  if (linkedState.scene === state.scene && base.length && linkOf(linkedState) === linkOf(state)) return;
  banner(ignored.length ? `The link has parts that mean nothing here: ${ignored.join(", ")}` : "");
  const first = typeof start.scene === "string" ? start.scene : own?.name;
  const set = linkedState.scene || Object.keys(linkedState.set).length ? linkedState.set : (start.set ?? {});
  await begin(linkedState.scene ?? first ?? FIRST_SCENE, set);
}

await main();
