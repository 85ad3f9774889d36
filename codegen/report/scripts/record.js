"use strict";
// The numbers of the page: columns of single precision, deflated, four planes of bytes each.
const record = (() => {
  const told = (id) => JSON.parse(document.getElementById(id).textContent);
  const columns = [];
  let bytes = new Uint8Array(0);
  let starts = [];
  let counts = [];

  async function open() {
    counts = told("counts");
    let at = 0;
    starts = counts.map((count) => {
      const start = at;
      at += 4 * count;
      return start;
    });
    const letters = atob(document.getElementById("columns").textContent.trim());
    const packed = new Uint8Array(letters.length);
    for (let i = 0; i < letters.length; i++) packed[i] = letters.charCodeAt(i);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // A column; numbers that are not finite become null, which is drawn as a gap.
  function column(number) {
    if (columns[number]) return columns[number];
    const count = counts[number];
    const start = starts[number];
    const joined = new Uint8Array(4 * count);
    for (let plane = 0; plane < 4; plane++) {
      for (let i = 0; i < count; i++) joined[4 * i + plane] = bytes[start + plane * count + i];
    }
    const values = new Float32Array(joined.buffer);
    const whole = values.every(Number.isFinite);
    columns[number] = whole ? values : Array.from(values, (value) => (Number.isFinite(value) ? value : null));
    return columns[number];
  }

  // The last place at which a rising column is not above a value.
  function place(times, value) {
    let low = 0;
    let high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= value) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  function shown(value, digits = 5) {
    if (value === null || value === undefined) return "–";
    return value === 0 ? "0" : String(Number(value.toPrecision(digits)));
  }

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  return { told, open, column, place, shown, colour };
})();
