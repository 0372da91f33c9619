// The permalink: scene and overrides as the fragment of the page's address.

/** Returns the fragment of a state `{ scene, set }`; `set` maps keys to texts. */
export function linkOf({ scene, set }) {
  const fields = new URLSearchParams({ scene });
  for (const [key, value] of Object.entries(set)) fields.append("set", `${key}=${value}`);
  return `#${fields}`;
}

/** Returns the state of a fragment, and texts about the parts that mean nothing. */
export function stateOf(fragment) {
  const state = { scene: null, set: {} },
    ignored = [];
  for (const [name, value] of new URLSearchParams(fragment.replace(/^#/, ""))) {
    const at = value.indexOf("=");
    if (name === "scene") state.scene = value;
    else if (name === "set" && at > 0) state.set[value.slice(0, at)] = value.slice(at + 1);
    else ignored.push(`${name}=${value}`.slice(0, 80));
  }
  return { state, ignored };
}
