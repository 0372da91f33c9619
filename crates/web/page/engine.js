// The engine: workers around one compiled WebAssembly module.

import { workerMain } from "./worker.js";

/** A refusal: messages, each with the key of the scene that it is about. */
export class Refusal extends Error {
  constructor(errors) {
    super(errors.map((error) => error.message).join("\n"));
    this.errors = errors;
  }
}

/** Thrown to the one who waits for an answer of a worker that was ended. */
export class Cancelled extends Error {}

/** Returns the module that is inlined in the page as gzip in base64. */
export async function compiled(text) {
  const packed = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return WebAssembly.compile(await new Response(stream).arrayBuffer());
}

/** A worker that answers requests one after another. It can be ended in the midst of one; the next one begins anew. */
export class Engine {
  constructor(module) {
    this.module = module;
    this.waiting = new Map();
    this.number = 0;
    this.worker = null;
  }

  begin() {
    const source = new Blob([`(${workerMain})()`], { type: "text/javascript" });
    const place = URL.createObjectURL(source);
    this.worker = new Worker(place);
    URL.revokeObjectURL(place);
    this.worker.onmessage = ({ data }) => {
      const waits = this.waiting.get(data.number);
      if (!waits) return;
      this.waiting.delete(data.number);
      // A module that has panicked is not used again.
      if (data.stopped) this.end();
      if (data.refused) waits.reject(new Refusal(data.result.errors));
      else waits.resolve(data);
    };
    this.worker.postMessage(this.module);
  }

  /** Returns `{ result, columns, file }`; rejects with a Refusal, or with Cancelled. */
  ask(request) {
    if (!this.worker) this.begin();
    const number = ++this.number;
    return new Promise((resolve, reject) => {
      this.waiting.set(number, { resolve, reject });
      this.worker.postMessage({ number, request });
    });
  }

  /** Ends what the worker computes; one that computes nothing stays. */
  drop() {
    if (this.waiting.size) this.end();
  }

  /** Ends the worker and whatever it computes. */
  end() {
    this.worker?.terminate();
    this.worker = null;
    const waiting = [...this.waiting.values()];
    this.waiting.clear();
    waiting.forEach(({ reject }) => reject(new Cancelled("cancelled")));
  }
}
