// Small helpers for elements.

/** Returns a new element. `properties` are set on it, those with a dash as attributes. */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.includes("-") || name === "role" || name === "for") element.setAttribute(name, value);
    else element[name] = value;
  }
  element.append(...children);
  return element;
}

export const find = (id) => document.getElementById(id);

/** Returns a number with so many significant digits, without needless zeros. */
export const digits = (value, count = 4) => String(Number(value.toPrecision(count)));

/** Returns a number in few letters, with an exponent where it is small. */
export const short = (value) =>
  value !== 0 && Math.abs(value) < 1e-3 ? Number(value.toPrecision(2)).toExponential() : digits(value, 3);
