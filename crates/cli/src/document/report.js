// Draws what the report holds: runs by hpuPlot, tables by hpuRows.
"use strict";

(() => {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);

  /** Returns the bytes of a text in base64 that gzip has made. */
  async function unpacked(text) {
    const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  /** Returns the series of a run: differences in bytes of 7 bits, signs in the lowest bits. */
  function series(run, bytes, axis) {
    let at = 0;
    const next = () => {
      let number = 0, by = 1, byte;
      do {
        byte = bytes[at++];
        number += (byte & 127) * by;
        by *= 128;
      } while (byte > 127);
      return number;
    };
    const times = (count) => {
      const all = new Float64Array(count);
      for (let i = 0, edge = 0; i < count; i++) all[i] = (edge += next()) * run.period;
      return all;
    };
    return run.series.map((one) => {
      const x = (axis[one.axis] ??= times(run.axes[one.axis]));
      const values = new Float64Array(x.length);
      for (let i = 0, word = 0; i < x.length; i++) {
        const number = next();
        word += number % 2 ? -(number + 1) / 2 : number / 2;
        values[i] = word * one.scale;
      }
      return { ...one, x, values };
    });
  }

  for (const place of document.querySelectorAll("[data-runs]")) {
    const ids = place.dataset.runs.split(" "), runs = ids.map(read);
    const bytes = (id) => unpacked(document.getElementById(`${id}-bytes`).textContent);
    Promise.all(ids.map(bytes)).then((all) => {
      hpuPlot(place, {
        xUnit: "s",
        series: runs.flatMap((run, i) => series(run, all[i], [])),
        markers: runs.flatMap((run) => run.markers),
        spans: runs.flatMap((run) => run.spans),
      });
    }).catch((error) => { place.textContent = `The run cannot be shown here: ${error.message}`; });
  }
  for (const place of document.querySelectorAll("[data-rows]")) hpuRows(place, read(place.dataset.rows));
})();
