// The explorer's page in headless Firefox, by WebDriver BiDi: the same bits as the native engine, a slider's pace, the
// map, and no word on the console.
// usage: node --experimental-websocket firefox.mjs PAGE HASHES; PAGE and HASHES as for test.mjs; the option is for
// Node.js before 22. FIREFOX names the browser's program.
// Prints a line a test; exits with 1 if one failed.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [place, hashes] = process.argv.slice(2);
const profile = fs.mkdtempSync(path.join(os.tmpdir(), "hpu-firefox-"));
const options = ["--headless", "--no-remote", "--profile", profile, "--remote-debugging-port", "0"];
const browser = spawn(process.env.FIREFOX || "firefox-esr", options, { stdio: ["ignore", "ignore", "pipe"] });
const listening = await new Promise((resolve, reject) => {
  let said = "";
  browser.stderr.on("data", (bytes) => {
    said += bytes;
    const found = /WebDriver BiDi listening on (ws:\S+)/.exec(said);
    if (found) resolve(found[1]);
  });
  browser.on("exit", () => reject(new Error(`the browser ended: ${said}`)));
});

const socket = new WebSocket(`${listening}/session`);
const waiting = new Map(),
  complaints = [];
let last = 0;
socket.addEventListener("message", ({ data }) => {
  const told = JSON.parse(data);
  if (told.method === "log.entryAdded") complaints.push(`${told.params.level}: ${told.params.text}`);
  const answer = waiting.get(told.id);
  if (!answer) return;
  waiting.delete(told.id);
  if (told.type === "error") answer.reject(new Error(`${told.error}: ${told.message}`));
  else answer.resolve(told.result);
});
await new Promise((resolve) => socket.addEventListener("open", resolve));

function send(method, params) {
  last += 1;
  socket.send(JSON.stringify({ id: last, method, params }));
  return new Promise((resolve, reject) => waiting.set(last, { resolve, reject }));
}

const { capabilities } = await send("session.new", { capabilities: {} });
await send("session.subscribe", { events: ["log.entryAdded"] });
const { contexts } = await send("browsingContext.getTree", {});
const context = contexts[0].context;
await send("browsingContext.navigate", { context, url: pathToFileURL(place).href, wait: "complete" });

/** Evaluates a function with an argument in the page, and returns what it returns, which must be JSON. */
async function inPage(work, argument) {
  const expression = `Promise.resolve((${work})(${JSON.stringify(argument ?? null)})).then(JSON.stringify)`;
  const told = await send("script.evaluate", { expression, target: { context }, awaitPromise: true });
  if (told.type === "exception") throw new Error(told.exceptionDetails.text);
  return told.result.value === undefined ? undefined : JSON.parse(told.result.value);
}

// The page has its first picture.
await inPage(async () => {
  while (document.body?.dataset.state !== "rippled") await new Promise((next) => setTimeout(next, 20));
});

let failed = 0,
  passed = 0;
async function test(name, work) {
  const begun = performance.now();
  complaints.length = 0;
  try {
    await work();
    assert.deepEqual(complaints, []);
    passed += 1;
    console.log(`test ${name} ... ok (${((performance.now() - begun) / 1000).toFixed(1)} s)`);
  } catch (error) {
    failed += 1;
    console.log(`test ${name} ... FAILED\n${error.stack}\n${complaints.join("\n")}`);
  }
}

const median = (all) => [...all].sort((one, other) => one - other)[Math.floor(all.length / 2)];

await test("every shipped scene has the bits of the native engine", async () => {
  const lines = fs.readFileSync(hashes, "utf8").trim().split("\n");
  const native = Object.fromEntries(lines.map((line) => line.split(" ")));
  assert.ok(lines.length >= 60);
  const own = await inPage(async (names) => {
    const one = hpuExplorer.engine(),
      found = {};
    for (const name of names) found[name] = (await one.ask({ do: "hash", scene: name })).result.hash;
    one.end();
    return found;
  }, Object.keys(native));
  assert.deepEqual(own, native);
});

await test("a slider's move comes to a picture", async () => {
  const all = await inPage(async () => {
    const slider = document.querySelector('[aria-label="wall.stiffness, slider"]'),
      until = async (is) => {
        while (!is()) await new Promise((next) => setTimeout(next, 5));
      },
      all = [];
    for (let move = 0; move < 28; move++) {
      const before = document.getElementById("command").textContent;
      slider.stepUp();
      slider.dispatchEvent(new Event("input", { bubbles: true }));
      await until(() => document.getElementById("command").textContent !== before);
      await until(() => ["idle", "rippled"].includes(document.body.dataset.state));
      if (move >= 5) all.push(Number(document.body.dataset.milliseconds));
    }
    return all;
  });
  assert.equal(all.length, 23);
  console.log(`slider on hybrid-wall: median ${median(all).toFixed(0)} ms of ${all.length} moves`);
});

await test("a map of 21 by 11 cells fills", async () => {
  const [cells, filled, seconds] = await inPage(async () => {
    document.getElementById("map-fill").click();
    const map = document.getElementById("map");
    while (!map.dataset.seconds) await new Promise((next) => setTimeout(next, 20));
    const count = (which) => document.querySelectorAll(`#map-grid .cell${which}`).length;
    return [count(""), count("[data-class]"), Number(map.dataset.seconds)];
  });
  assert.deepEqual([cells, filled], [21 * 11, 21 * 11]);
  console.log(`map: ${seconds.toFixed(1)} s`);
});

console.log(`${capabilities.browserName} ${capabilities.browserVersion}: ${passed} passed, ${failed} failed`);
socket.close();
browser.removeAllListeners("exit");
await new Promise((resolve) => {
  browser.on("exit", resolve);
  browser.kill();
});
fs.rmSync(profile, { recursive: true, force: true });
process.exit(failed ? 1 : 0);
