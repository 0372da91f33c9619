// The explorer's page in headless Chromium: the same bits as the native engine, its pace, its controls, its refusals.
// usage: node test.mjs PAGE HASHES MODULES; PAGE is explorer.html, HASHES a file of `scene hash` lines of the native
// engine, MODULES a folder with node_modules. BROWSER names the browser's program.
// Prints a line a test; exits with 1 if one failed.

import assert from "node:assert/strict";
import fs from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";
import zlib from "node:zlib";
import { linkOf, stateOf } from "../../crates/web/page/link.js";

const [place, hashes, modules] = process.argv.slice(2);
const { chromium } = createRequire(`${modules}/package.json`)("playwright-core");
const url = pathToFileURL(place).href,
  whole = fs.readFileSync(place, "utf8");
const args = process.getuid?.() === 0 ? ["--no-sandbox"] : [];
const browser = await chromium.launch({ executablePath: process.env.BROWSER || "/usr/bin/chromium", args });
let failed = 0,
  passed = 0;

/** Runs a test; a page that says anything on the console, throws, or asks a network fails it. */
async function test(name, work, options = {}) {
  if (process.env.ONLY && !name.includes(process.env.ONLY)) return;
  const { path = "", inject, ...context } = options;
  const begun = performance.now(),
    complaints = [];
  const page = await browser.newPage({ viewport: { width: 1300, height: 900 }, ...context });
  page.on("console", (message) => complaints.push(`console ${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => complaints.push(`error: ${error.message}`));
  page.on("request", (request) => {
    if (
      !/^(file|blob|data):/.test(request.url()) ||
      (request.url().startsWith("file:") && !request.url().startsWith(url))
    ) {
      complaints.push(`request: ${request.url()}`);
    }
  });
  try {
    if (inject) await page.addInitScript(inject);
    await page.goto(url + path);
    await work(page);
    assert.deepEqual(complaints, []);
    passed += 1;
    console.log(`test ${name} ... ok (${((performance.now() - begun) / 1000).toFixed(1)} s)`);
  } catch (error) {
    failed += 1;
    console.log(`test ${name} ... FAILED\n${error.stack}\n${complaints.join("\n")}`);
  }
  await page.close();
}

/** Tests without a clock run two at a time, after all others. */
const waiting = [];
const beside = (...one) => waiting.push(one);

const text = (page, id) => page.locator(`#${id}`).textContent();
/** Waits until the page has answered all changes; `rippled` waits for the ripple too. */
const rest = (page, state = ["idle", "rippled"]) =>
  page.waitForFunction(
    (states) => states.includes(document.body.dataset.state) && document.getElementById("verdict").textContent,
    state,
  );
const overrides = (page) => page.evaluate(() => new URLSearchParams(location.hash.slice(1)).getAll("set"));
/** Writes a value into a control. */
const put = async (page, key, value) => {
  const field = page.locator(`#key-${key.replaceAll(".", "-")}`);
  await field.fill(value);
  await field.press("Enter");
};
/** Figures are those of idle cores; on busy ones a test only tells whether they are of that order. */
const SLACK = Number(process.env.SLACK || 1);
const median = (all) => [...all].sort((one, other) => one - other)[Math.floor(all.length / 2)];

await test("every shipped scene has the bits of the native engine", async (page) => {
  await rest(page);
  const native = fs
    .readFileSync(hashes, "utf8")
    .trim()
    .split("\n")
    .map((line) => line.split(" "));
  assert.ok(native.length >= 60);
  const own = await page.evaluate(
    async (names) => {
      const two = [hpuExplorer.engine(), hpuExplorer.engine()],
        found = {};
      await Promise.all(
        two.map(async (one) => {
          for (let name = names.shift(); name; name = names.shift()) {
            found[name] = (await one.ask({ do: "hash", scene: name })).result.hash;
          }
        }),
      );
      two.forEach((one) => one.end());
      return found;
    },
    native.map(([name]) => name),
  );
  assert.deepEqual(own, Object.fromEntries(native));
});

await test("a slider's move is in the picture within 100 ms, with its ripple", async (page) => {
  await rest(page, ["rippled"]);
  const slider = page.locator('[aria-label="wall.stiffness, slider"]'),
    first = [],
    all = [];
  // The first runs are compiled while they run.
  for (let move = 0; move < 28; move++) {
    const before = await text(page, "command");
    await slider.press("ArrowRight");
    await page.waitForFunction((old) => document.getElementById("command").textContent !== old, before);
    await rest(page, ["rippled"]);
    if (move < 5) continue;
    const [plain, rippled] = await page.evaluate(() => [
      document.body.dataset.milliseconds,
      document.body.dataset.rippled,
    ]);
    first.push(Number(plain));
    all.push(Number(rippled));
  }
  const moves = all.map(Math.round).join(" ");
  console.log(
    `slider on hybrid-wall: median ${median(first).toFixed(0)} ms of ${first.length} moves; ` +
      `with its ripple ${median(all).toFixed(0)} ms: ${moves}`,
  );
  assert.ok(median(first) <= 100 * SLACK, `${median(first)} ms`);
  assert.ok(median(all) <= 100 * SLACK, `${median(all)} ms with the ripple`);
});

await test("a map of 21 by 11 cells of 1 s fills within 10 s, and a click loads a cell", async (page) => {
  await rest(page);
  await page.click("#map-fill");
  await page.waitForFunction(() => document.getElementById("map").dataset.seconds);
  const seconds = Number(await page.locator("#map").getAttribute("data-seconds"));
  console.log(`map: ${await text(page, "map-status")}`);
  assert.equal(await page.locator("#map-grid .cell").count(), 21 * 11);
  assert.equal(await page.locator("#map-grid .cell:not([data-class])").count(), 0);
  assert.ok((await page.locator('#map-grid .cell[data-class="limit_cycle"]').count()) > 10);
  const cell = page.locator('#map-grid .cell[data-class="limit_cycle"]').first(),
    place = await cell.getAttribute("title");
  await cell.click();
  await rest(page);
  assert.match(await text(page, "verdict"), /^limit cycle/);
  const [x] = place.split(", ");
  assert.ok((await overrides(page)).includes(`wall.stiffness=${x}`), place);
  // Arrows move between cells; Enter loads.
  await cell.focus();
  await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("Enter");
  await rest(page);
  assert.ok(!(await overrides(page)).includes(`wall.stiffness=${x}`));
  assert.ok(seconds <= 10 * SLACK, `${seconds} s`);
});

beside("somebody makes a wall ring by taking away one bit", async (page) => {
  await rest(page);
  await page.getByRole("button", { name: /A wall that holds/ }).click();
  await page.waitForFunction(() => document.getElementById("command").textContent.includes("10khz"));
  assert.match(await text(page, "verdict"), /^settled/);
  await page.getByRole("button", { name: /One bit less/ }).click();
  await page.waitForFunction(() => document.getElementById("command").textContent.includes("encoder.lines=512"));
  assert.match(await text(page, "verdict"), /^limit cycle/);
});

beside("a refused value has its message at its control, and the next good one goes on", async (page) => {
  await rest(page);
  await put(page, "wall.stiffness", "-1");
  const error = page.locator("#key-wall-stiffness-error");
  await page.waitForFunction(() => document.getElementById("key-wall-stiffness-error").textContent);
  assert.equal(await error.textContent(), "--set wall.stiffness=-1: wall.stiffness: `-1` must not be negative");
  assert.equal(await page.locator("#key-wall-stiffness").getAttribute("aria-invalid"), "true");
  await put(page, "wall.stiffness", "2 apples");
  await page.waitForFunction(() => document.getElementById("key-wall-stiffness-error").textContent.includes("apples"));
  await put(page, "wall.stiffness", "2 N.m/rad");
  await page.waitForFunction(() => document.getElementById("command").textContent.includes("2 N.m/rad"));
  assert.equal(await error.textContent(), "");
});

beside(
  "a permalink brings back scene and values",
  async (page) => {
    await rest(page);
    assert.equal(await text(page, "command"), "hpu run friction-wall --set wall.damping=0 --set run.duration='100 ms'");
    assert.equal(await page.locator("#key-run-duration").inputValue(), "100 ms");
    await page.click("#reset-all");
    await page.waitForFunction(() => document.getElementById("command").textContent === "hpu run friction-wall");
  },
  { path: linkOf({ scene: "friction-wall", set: { "wall.damping": "0", "run.duration": "100 ms" } }) },
);

beside(
  "a permalink of nonsense is told, and the page goes on",
  async (page) => {
    await page.waitForFunction(() => document.getElementById("banner").textContent);
    await rest(page);
    assert.match(await text(page, "banner"), /no scene `no-such`.*did you mean|no scene `no-such`/s);
    assert.match(await text(page, "verdict"), /^settled/);
    await page.evaluate(() => {
      location.hash = "#scene=hybrid-wall&set=wall.stiffness%3D%F0%9F&set=what.is=this&x=%&set";
    });
    await page.waitForFunction(() => document.querySelector("#errors li"));
    assert.match(await text(page, "banner"), /mean nothing/);
    assert.match(await text(page, "errors"), /what/);
    assert.ok(await text(page, "key-wall-stiffness-error"));
  },
  { path: "#scene=no-such&set=a" },
);

beside("a scene that never ends is cancelled, and the page stays alive", async (page) => {
  await rest(page);
  await put(page, "run.duration", "100000 s");
  await page.locator("#cancel").waitFor({ state: "visible" });
  await page.click("#cancel");
  await page.waitForFunction(() => document.querySelector("#errors li"));
  assert.match(await text(page, "errors"), /cancelled/);
  await put(page, "run.duration", "1 s");
  await page.waitForFunction(() => document.getElementById("command").textContent.includes("1 s"));
  await rest(page);
  // Another value ends a long run too.
  await put(page, "run.duration", "100000 s");
  await page.locator("#cancel").waitFor({ state: "visible" });
  await page.waitForTimeout(600);
  await put(page, "run.duration", "500 ms");
  await page.waitForFunction(() => document.getElementById("command").textContent.includes("500 ms"));
});

beside("a zoom shows single edges of the PWM, with the exact torque", async (page) => {
  await rest(page, ["rippled"]);
  await page.getByRole("checkbox", { name: "Draw a_high" }).check();
  await rest(page, ["rippled"]);
  const canvas = page.locator("#picture canvas");
  await canvas.focus();
  for (let zoom = 0; zoom < 13; zoom++) await page.keyboard.press("+");
  await page.waitForFunction(() => Number(document.body.dataset.looked) <= 2e-7);
  await page.waitForFunction(() => {
    const { x, values } = hpuExplorer.picture.shown.series.find(({ name }) => name === "a_high");
    const near = x.findIndex((t) => t > 1);
    return values.subarray(near - 1500, near + 1500).some((value) => value === 1) && x[near] - x[near - 1] <= 2e-7;
  });
});

beside(
  "waveforms are saved",
  async (page) => {
    await rest(page);
    for (const [format, head] of [
      ["fst", "\0"],
      ["vcd", "$version\n    hpu "],
    ]) {
      const [saved] = await Promise.all([page.waitForEvent("download"), page.click(`#save-${format}`)]);
      assert.equal(saved.suggestedFilename(), `one-tick.${format}`);
      const bytes = fs.readFileSync(await saved.path(), "latin1");
      assert.ok(bytes.startsWith(head) && bytes.length > 300, format);
    }
  },
  { path: "#scene=one-tick" },
);

beside("a method is chosen from the list, and its own keys become controls", async (page) => {
  await rest(page);
  await page.locator("#method").selectOption({ index: 4 });
  await page.waitForFunction(() => document.getElementById("command").textContent.includes("method.kind="));
  await rest(page);
  const kind = (await overrides(page)).find((one) => one.startsWith("method.kind=")).slice(12);
  assert.equal(await page.locator("#key-method-kind").inputValue(), kind);
  await page.locator("#method").selectOption({ index: 0 });
  await page.waitForFunction(() => document.getElementById("command").textContent === "hpu run hybrid-wall");
});

beside(
  "a device of bodies and joints is drawn, and no other is",
  async (page) => {
    await rest(page);
    const drawn = page.locator("#device svg");
    assert.deepEqual(await drawn.locator(".head").allTextContents(), ["motor", "load"]);
    assert.match(await drawn.textContent(), /encoder[^]*load: lines/);
    await page.locator("#scene").selectOption("hybrid-wall");
    await page.waitForFunction(() => document.getElementById("command").textContent === "hpu run hybrid-wall");
    await rest(page);
    assert.equal(await drawn.count(), 0);
  },
  { path: "#scene=two-encoder-joint" },
);

beside("every control is reached by the Tab key, and has a name", async (page) => {
  await rest(page, ["rippled"]);
  await page.evaluate(() =>
    document.querySelectorAll("details").forEach((section) => {
      section.open = true;
    }),
  );
  const wanted = await page.evaluate(() => {
    const all = [...document.querySelectorAll("button, input, select, summary, canvas, a[href]")];
    // One cell of a grid stands for all.
    const reached = all.filter((one) => one.checkVisibility() && !one.disabled && one.tabIndex >= 0);
    const seen = (globalThis.seen = new Set());
    reached.forEach((one, at) => one.addEventListener("focus", () => seen.add(at)));
    return reached.map(
      (one) => one.getAttribute("aria-label") || one.labels?.[0]?.textContent || one.textContent || "",
    );
  });
  assert.ok(wanted.length > 100);
  assert.deepEqual(
    wanted.filter((name) => !name.trim()),
    [],
  );
  await page.evaluate(() => {
    document.activeElement?.blur();
    seen.clear();
  });
  for (let press = 0; press < wanted.length + 20; press++) await page.keyboard.press("Tab");
  const seen = await page.evaluate(() => [...globalThis.seen]);
  assert.deepEqual(
    wanted.filter((_, at) => !seen.includes(at)),
    [],
  );
});

beside("every text has a contrast of 4.5, light and dark", async (page) => {
  await rest(page, ["rippled"]);
  await page.click("#map-fill");
  await page.waitForFunction(() => document.getElementById("map").dataset.seconds);
  await put(page, "wall.stiffness", "-1");
  await page.waitForFunction(() => document.getElementById("key-wall-stiffness-error").textContent);
  await page.evaluate(() => {
    for (const section of document.querySelectorAll("details")) section.open = true;
  });
  const backs = [];
  for (const colorScheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme });
    backs.push(await page.evaluate(() => getComputedStyle(document.body).backgroundColor));
    const poor = await page.evaluate(() => {
      const numbers = (color) => color.match(/[\d.]+/g).map(Number);
      const light = (color) => {
        const [r, g, b] = numbers(color).map((part) =>
          part / 255 <= 0.04045 ? part / 255 / 12.92 : ((part / 255 + 0.055) / 1.055) ** 2.4,
        );
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
      };
      const behind = (element) => {
        for (let at = element; at; at = at.parentElement) {
          const color = getComputedStyle(at).backgroundColor,
            parts = numbers(color);
          if (parts.length < 4 || parts[3] === 1) return color;
        }
        return "rgb(255, 255, 255)";
      };
      const contrast = (one, other) => {
        const [high, low] = [light(one), light(other)].sort((a, b) => b - a);
        return (high + 0.05) / (low + 0.05);
      };
      const found = [];
      for (const element of document.querySelectorAll("body *")) {
        const own = [...element.childNodes].some(
          (node) => node.nodeType === Node.TEXT_NODE && node.textContent.trim(),
        );
        if ((!own && !element.value) || !element.checkVisibility() || element.matches("option, script, style, .skip"))
          continue;
        const ratio = contrast(getComputedStyle(element).color, behind(element));
        if (ratio < 4.5) found.push(`${element.tagName} ${element.id} ${element.className} ${ratio.toFixed(2)}`);
      }
      return [...new Set(found)];
    });
    assert.deepEqual(poor, [], colorScheme);
  }
  assert.notEqual(...backs);
});

beside(
  "a narrow screen shows all without a sideways scroll",
  async (page) => {
    await rest(page);
    const [wide, seen] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    const out = await page.evaluate(() =>
      [...document.querySelectorAll("body *")]
        .filter((one) => one.getBoundingClientRect().right > innerWidth && !one.closest(".scroll, .skip"))
        .map((one) => `${one.tagName} ${one.id} ${one.className}`),
    );
    assert.ok(wide <= seen, `${wide} > ${seen}: ${out}`);
  },
  { viewport: { width: 360, height: 740 } },
);

beside(
  "a browser without WebAssembly is told so",
  async (page) => {
    await page.waitForFunction(() => document.getElementById("banner").textContent);
    assert.match(await text(page, "banner"), /no WebAssembly/);
  },
  {
    inject: () => {
      delete globalThis.WebAssembly;
    },
  },
);

beside("links are read and written without loss", async () => {
  const state = {
    scene: "hybrid-wall",
    set: { "hand.path": '[["0 s", 0], ["1 s", "1 rad"]]', about: "a & b = c # 100 %" },
  };
  assert.deepEqual(stateOf(linkOf(state)), { state, ignored: [] });
  assert.deepEqual(stateOf(""), { state: { scene: null, set: {} }, ignored: [] });
  assert.deepEqual(stateOf("#set=novalue&set==1&x=1").ignored, ["set=novalue", "set==1", "x=1"]);
});

beside("the page is small enough", async () => {
  const packed = zlib.gzipSync(whole, { level: 9 }).length;
  console.log(`page: ${whole.length} bytes, ${packed} compressed`);
  assert.ok(packed <= 1.5e6 && whole.length <= 3e6);
});

const next = async () => {
  while (waiting.length) await test(...waiting.shift());
};
await Promise.all([next(), next()]);
await browser.close();
console.log(`browser: ${passed} passed, ${failed} failed`);
process.exit(failed ? 1 : 0);
