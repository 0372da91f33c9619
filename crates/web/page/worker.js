// The worker: it holds one WebAssembly instance and answers one request at a time. Its text is put into a Blob, so it
// imports nothing.

/** Runs inside the worker. The first message is the compiled module; every other one is a request with its number. */
export function workerMain() {
  let engine = null,
    begun = null;
  const text = (bytes) => new TextDecoder().decode(bytes);
  const bytes = (at, length) => new Uint8Array(engine.memory.buffer, at, length);
  const json = () => JSON.parse(text(bytes(engine.hpu_json(), engine.hpu_json_length())));

  function answer(request) {
    const asked = new TextEncoder().encode(JSON.stringify(request));
    bytes(engine.hpu_take(asked.length), asked.length).set(asked);
    const refused = engine.hpu_answer() !== 0;
    const result = json();
    // The memory of the module may move at the next request: columns and file are copied out of it.
    const columns = (refused ? [] : result.columns || []).map((_, at) =>
      new Float64Array(engine.memory.buffer, engine.hpu_column(at), engine.hpu_column_length(at)).slice(),
    );
    const file = bytes(engine.hpu_file(), engine.hpu_file_length()).slice();
    return { refused, result, columns, file };
  }

  self.onmessage = async ({ data }) => {
    if (data instanceof WebAssembly.Module) {
      begun = WebAssembly.instantiate(data, {});
      return;
    }
    engine = (await begun).exports;
    let reply;
    try {
      reply = answer(data.request);
    } catch (error) {
      // A panic has ended the module; its message lies where JSON would lie.
      let result = null;
      try {
        result = json();
      } catch {
        /* no message */
      }
      if (!result || !result.errors)
        result = { errors: [{ key: "", message: `the engine stopped: ${error.message}` }] };
      reply = { refused: true, stopped: true, result, columns: [], file: new Uint8Array() };
    }
    self.postMessage({ number: data.number, ...reply }, [
      ...reply.columns.map((column) => column.buffer),
      reply.file.buffer,
    ]);
  };
}
