// Controls made from the keys of a scene. A control changes one override; its range comes from the key and the scene.

import { digits, find, make } from "./dom.js";

/** Keys that stand above all others, in this order, where a scene has them. */
const FIRST = [
  "wall.stiffness",
  "wall.damping",
  "method.sample_rate",
  "clock.frequency",
  "encoder.lines",
  "method.position_bits",
  "method.velocity_bits",
  "method.period_bits",
  "method.pwm.bits",
  "method.stiffness_format",
  "method.damping_format",
  "method.product",
  "device.coulomb_friction",
  "device.friction",
  "hand.stiffness",
  "hand.damping",
  "run.duration",
];

/** Ends of sliders of quantities that are 0 in a scene, by their units. */
const FROM_ZERO = { "N.m": 0.02, N: 2, "N.m.s/rad": 1e-3, "N.s/m": 5, ohm: 5, s: 1e-3, V: 1, rad: 1, m: 0.01 };

/** How far a slider reaches below and above the scene's value. */
const REACH = 30,
  STEPS = 400;

/** Number of controls above all others, and the other keys that fill it. */
const ENOUGH = 8,
  OTHERS = /(stiffness|damping|mass|friction|gain|rate|force|speed|viscous|position|bits|format)$/;

/** Returns the keys that stand above all others. */
function firstOf(keys) {
  const first = FIRST.map((name) => keys.find(({ key }) => key === name)).filter(Boolean);
  const rest = keys.filter((key) => key.given && OTHERS.test(key.key) && !first.includes(key));
  return [...first, ...rest.slice(0, Math.max(0, ENOUGH - first.length))];
}

const idOf = (key) => `key-${key.replace(/[^a-z0-9_]/gi, "-")}`;

/** Returns a value of TOML without its quotes, as `--set` takes it. */
const plain = (toml) => (/^".*"$/s.test(toml) ? JSON.parse(toml) : toml);

/** The controls of a scene. `change(key, text)` is called with an override, or with null for the scene's own value. */
export class Controls {
  constructor(change) {
    this.change = change;
    this.rows = new Map();
  }

  /** Makes the controls anew: those of `base`, the scene as it is written, with the values of `set`. */
  build(keys, base, set) {
    const focused = document.activeElement?.id;
    this.rows.clear();
    const shown = keys.filter(({ section, key }) => section && !/^(expect|accuracy|record)\b/.test(key));
    const original = new Map(base.map((key) => [key.key, key]));
    const first = firstOf(shown);
    find("main-controls").replaceChildren(...first.map((key) => this.row(key, original.get(key.key), set)));
    const sections = [...new Set(shown.map(({ section }) => section))];
    find("all-controls").replaceChildren(
      ...sections
        .map((section) => {
          const others = shown.filter((key) => key.section === section && !first.includes(key));
          return make(
            "details",
            { className: "section" },
            make("summary", {}, `[${section}]`),
            ...others.map((key) => this.row(key, original.get(key.key), set)),
          );
        })
        .filter((section) => section.children.length > 1),
    );
    if (focused) find(focused)?.focus();
  }

  /** Returns a control with its label, its errors and a button that restores the scene's value. */
  row(key, original, set) {
    const id = idOf(key.key),
      toml = original?.toml ?? key.toml;
    const own = toml === null ? "" : plain(toml);
    const send = (text) => this.change(key.key, text === own ? null : text);
    const error = make("p", { className: "error", id: `${id}-error`, role: "alert" });
    const reset = make("button", {
      type: "button",
      className: "reset",
      textContent: "↺",
      title: `Back to ${own || "the scene's value"}`,
      "aria-label": `Reset ${key.key} to ${own || "the scene's value"}`,
      onclick: () => {
        show(own);
        this.change(key.key, null);
      },
    });
    const input = this.input(key, id, own, original?.value ?? key.value, send);
    const label = make("label", { for: id, title: key.meaning }, key.key);
    const row = make(
      "div",
      { className: "control" },
      make("div", { className: "head" }, label, reset),
      input.element,
      error,
    );
    const show = (text) => {
      input.show(text);
      row.classList.toggle("changed", text !== own);
      reset.hidden = text === own;
    };
    show(set[key.key] ?? own);
    this.rows.set(key.key, { row, error, show, own });
    return row;
  }

  /** Returns the element of a control, and a function that shows a value in it. */
  input(key, id, own, value, send) {
    const { takes } = key,
      described = { id, "aria-describedby": `${id}-error` };
    const tell = { title: key.meaning };
    if (takes.kind === "choice") {
      const select = make(
        "select",
        { ...described, ...tell, onchange: () => send(select.value) },
        ...takes.options.map((name) => make("option", { value: name }, name)),
      );
      return {
        element: select,
        show: (text) => {
          select.value = text;
        },
      };
    }
    if (takes.kind === "flag") {
      const box = make("input", { ...described, ...tell, type: "checkbox", onchange: () => send(String(box.checked)) });
      return {
        element: box,
        show: (text) => {
          box.checked = text === "true";
        },
      };
    }
    const field = make("input", {
      ...described,
      ...tell,
      type: "text",
      spellcheck: false,
      autocomplete: "off",
      onchange: () => send(field.value.trim()),
    });
    field.addEventListener("keydown", (event) => {
      if (event.key === "Enter") send(field.value.trim());
    });
    const parts = [field],
      shows = [
        (text) => {
          field.value = text;
        },
      ];
    const step = (name, sign, next) =>
      parts.push(
        make("button", {
          type: "button",
          className: "step",
          textContent: sign,
          title: name,
          "aria-label": `${key.key}: ${name}`,
          onclick: () => {
            const text = next(field.value);
            if (text) {
              shows.forEach((show) => show(text));
              send(text);
            }
          },
        }),
      );
    if (takes.kind === "whole" && takes.most - takes.least > 1) {
      const what = takes.unit === "bit" ? "one bit" : "one";
      const by = (change) => (text) => {
        const number = Number(text) + change;
        return number >= takes.least && number <= takes.most ? String(number) : null;
      };
      step(`${what} less`, "−1", by(-1));
      step(`${what} more`, "+1", by(1));
    }
    if (takes.kind === "format") {
      const by = (integer, fraction) => (text) => {
        const [sign, whole, part] = (text.match(/-?\d+/g) || []).map(Number);
        return part === undefined ? null : `(${sign},${whole + integer},${part + fraction})`;
      };
      step("one fraction bit less", "f−1", by(0, -1));
      step("one fraction bit more", "f+1", by(0, 1));
      step("one integer bit less", "i−1", by(-1, 0));
      step("one integer bit more", "i+1", by(1, 0));
    }
    const element = make("div", { className: "fields" }, ...parts);
    if (takes.kind === "quantity" && typeof value === "number") {
      const slider = this.slider(key, value, (text) => {
        field.value = text;
        send(text);
      });
      if (slider) {
        element.prepend(slider.element);
        shows.push(slider.show);
      }
    }
    return { element, show: (text) => shows.forEach((show) => show(text)) };
  }

  /** Returns a slider around a scene's value, by ratios, or from 0 where the scene has 0. */
  slider({ key, takes }, value, send) {
    const unit = takes.unit,
      size = Math.abs(value),
      zero = value === 0;
    const end = zero ? FROM_ZERO[unit] : Math.min(size * REACH, takes.most);
    if (!end) return null;
    const start = zero ? 0 : Math.max(size / REACH, takes.least > 0 ? takes.least : 0);
    const valueAt = (step) =>
      zero ? (end * step) / STEPS : Math.sign(value) * start * (end / start) ** (step / STEPS);
    const element = make("input", {
      type: "range",
      min: 0,
      max: STEPS,
      step: 1,
      "aria-label": `${key}, slider`,
      oninput: () => {
        const text = `${digits(valueAt(element.valueAsNumber), 4)} ${unit}`.trim();
        tell(text);
        send(text);
      },
    });
    const tell = (text) => element.setAttribute("aria-valuetext", text);
    const show = (text) => {
      const number = quantity(text, unit);
      if (number === null) return;
      const share = zero ? number / end : Math.log(Math.abs(number) / start) / Math.log(end / start);
      element.value = Math.round(STEPS * Math.min(Math.max(share || 0, 0), 1));
      tell(text);
    };
    return { element, show };
  }

  /** Shows the values of a set of overrides. */
  show(set) {
    for (const [key, { show, own }] of this.rows) show(set[key] ?? own);
  }

  /** Shows errors at their controls, and returns those that have none. */
  showErrors(errors) {
    for (const { row, error } of this.rows.values()) {
      error.textContent = "";
      row.classList.remove("refused");
      row.querySelector("[aria-describedby]").removeAttribute("aria-invalid");
    }
    return errors.filter(({ key, message }) => {
      const at = this.rows.get(key) ?? this.rows.get(key.replace(/\[.*$/, ""));
      if (!at) return true;
      at.error.textContent += `${at.error.textContent && "\n"}${message}`;
      at.row.classList.add("refused");
      at.row.querySelector("[aria-describedby]").setAttribute("aria-invalid", "true");
      at.row.closest("details")?.setAttribute("open", "");
      return false;
    });
  }
}

/** Returns the value of a text in SI units; null if it has another unit than this one with an SI prefix. */
export function quantity(text, unit) {
  const [, number, symbol] = text.match(/^\s*([-+0-9.eE]+)\s*(.*?)\s*$/) || [];
  const prefixes = { "": 1, p: 1e-12, n: 1e-9, u: 1e-6, m: 1e-3, k: 1e3, M: 1e6, G: 1e9 };
  if (number === undefined || Number.isNaN(Number(number))) return null;
  if (!symbol || symbol === unit) return Number(number);
  const prefix = symbol.endsWith(unit) && unit ? symbol.slice(0, symbol.length - unit.length) : null;
  return prefix in prefixes ? Number(number) * prefixes[prefix] : null;
}
