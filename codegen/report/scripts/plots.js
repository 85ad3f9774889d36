"use strict";
// Plots over time whose zoom and cursor are one, with limits, shaded stretches and the moment of the slider.
const plots = (() => {
  const GUTTER = 74;
  let drawn = [];
  let span = [0, 1];
  let linking = false;
  let chosen = () => {};
  let now = null;
  const hatch = [[], [6, 4], [2, 3]];

  const canvasFont = (size) => `${size}px ${record.colour("font") || "sans-serif"}`;

  function link(source) {
    if (linking) return;
    linking = true;
    const { min, max } = source.scales.x;
    for (const one of drawn) if (one.u !== source) one.u.setScale("x", { min, max });
    linking = false;
  }

  function mark(u, t) {
    const line = u.over.querySelector(".now");
    if (!line) return;
    const { min, max } = u.scales.x;
    line.hidden = t === null || t < min || t > max;
    if (!line.hidden) line.style.transform = `translateX(${u.valToPos(t, "x")}px)`;
  }

  function ordinate(plot) {
    const wanted = plot.levels.map((level) => level.value);
    if (plot.kind === "map") return { v: { range: [0, 1] }, y: { range: [plot.series.length + 0.5, 0.5] } };
    if (plot.axis.kind === "log") return { y: { distr: 3 } };
    if (plot.axis.kind === "asinh") return { y: { distr: 4, asinh: plot.axis.finest } };
    const range = (u, low, high) => {
      if (low === null) return [-1, 1];
      const reach = Math.max(Math.abs(low), Math.abs(high));
      for (const value of wanted) {
        if (Math.abs(value) > 4 * reach && reach > 0) continue;
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
      const room = 0.06 * (high - low) || Math.abs(high) * 0.1 || 1;
      return [low - room, high + room];
    };
    return { y: { range } };
  }

  // Marks at decades, few enough to be read; on both sides of zero where the axis has two.
  function decades(low, high, finest) {
    const last = Math.ceil(Math.log10(Math.max(Math.abs(low), Math.abs(high), 1e-300)));
    const first = Math.max(finest ? Math.round(Math.log10(finest)) + 1 : Math.floor(Math.log10(Math.max(low, 1e-300))), last - 40);
    const step = Math.max(1, Math.ceil((last - first + 1) / (finest ? 3 : 6)));
    const sizes = [];
    for (let k = last; k >= first; k -= step) sizes.push(10 ** k);
    const both = finest ? [...sizes.map((size) => -size), 0, ...sizes.toReversed()] : sizes.toReversed();
    return both.filter((value) => value >= low && value <= high);
  }

  function marks(plot) {
    if (plot.kind === "map") return { splits: () => plot.series.map((_, i) => i + 1), values: (u, at) => at.map(String) };
    const values = (u, at) => at.map((value) => (value === null ? "" : tick(value)));
    if (plot.axis.kind === "linear") return { values };
    return { values, splits: (u, axis, low, high) => decades(low, high, plot.axis.finest), filter: (u, at) => at };
  }

  function shade(u, stretches) {
    const { left, top, width, height } = u.bbox;
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(left, top, width, height);
    u.ctx.clip();
    u.ctx.fillStyle = record.colour("shade");
    for (const [from, to] of stretches) {
      const a = u.valToPos(from, "x", true);
      u.ctx.fillRect(a, top, Math.max(1, u.valToPos(to, "x", true) - a), height);
    }
    u.ctx.restore();
  }

  function lines(u, plot, statuses) {
    const { left, top, width, height } = u.bbox;
    const { ctx } = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    ctx.strokeStyle = record.colour("quiet");
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
    if (plot.kind !== "map") {
      for (const level of plot.levels) {
        const y = Math.round(u.valToPos(level.value, "y", true));
        ctx.beginPath();
        ctx.moveTo(left, y);
        ctx.lineTo(left + width, y);
        ctx.stroke();
      }
    }
    ctx.setLineDash([]);
    const size = 6 * devicePixelRatio;
    for (const status of statuses) {
      const x = u.valToPos(status.first, "x", true);
      ctx.fillStyle = record.colour(status.gravity === "note" ? "link" : status.gravity);
      ctx.beginPath();
      ctx.moveTo(x - size, top);
      ctx.lineTo(x + size, top);
      ctx.lineTo(x, top + 1.4 * size);
      ctx.fill();
    }
    ctx.restore();
  }

  const stops = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [254, 232, 56]];
  function ramp(share) {
    const at = Math.min(1, Math.max(0, share)) * (stops.length - 1);
    const i = Math.min(stops.length - 2, Math.floor(at));
    const mixed = stops[i].map((low, k) => Math.round(low + (at - i) * (stops[i + 1][k] - low)));
    return `rgb(${mixed.join(",")})`;
  }

  // Rows of a map: brightness is the largest magnitude within a pixel, of what the bounds allow.
  function rows(u, plot, times, values) {
    const { left, top, width, height } = u.bbox;
    const most = mostOf(plot, values);
    const tall = height / values.length;
    let at = record.place(times, u.posToVal(0, "x"));
    for (let px = 0; px < width; px++) {
      const until = u.posToVal((px + 1) / devicePixelRatio, "x");
      let end = at;
      while (end + 1 < times.length && times[end + 1] <= until) end++;
      for (let row = 0; row < values.length; row++) {
        let largest = 0;
        for (let i = at; i <= end; i++) largest = Math.max(largest, Math.abs(values[row][i] ?? 0));
        u.ctx.fillStyle = ramp(most > 0 ? largest / most : 0);
        u.ctx.fillRect(left + px, top + row * tall, 1, tall - devicePixelRatio);
      }
      at = end;
    }
  }

  function mostOf(plot, values) {
    if (plot.bounds) return Math.max(...plot.bounds.map(Math.abs));
    return values.reduce((most, one) => one.reduce((found, value) => Math.max(found, Math.abs(value ?? 0)), most), 0);
  }

  function make(plot, statuses, home) {
    const figure = document.createElement("section");
    figure.className = "plot";
    figure.id = plot.id;
    figure.tabIndex = 0;
    const title = document.createElement("h3");
    title.textContent = `${plot.label}${plot.unit ? ` [${plot.unit}]` : ""} `;
    const small = document.createElement("small");
    small.textContent = plot.rows < plot.of ? `${plot.rows} of ${plot.of} samples, every peak kept` : `${plot.of} samples`;
    title.append(small);
    figure.setAttribute("aria-label", `Plot of ${plot.label} over time; plus and minus zoom, arrows move, 0 shows all`);
    figure.append(title);
    home.append(figure);
    const times = record.column(plot.x);
    const values = plot.series.map((one) => record.column(one.a));
    const ink = record.colour("ink");
    const grid = { stroke: record.colour("grid"), width: 1 };
    const map = plot.kind === "map";
    const series = plot.series.map((one, i) => ({
      label: one.label || plot.label,
      scale: map ? "v" : "y",
      stroke: map ? record.colour("quiet") : record.colour(`c${one.colour}`),
      width: one.style === "line" ? 1.6 : 1,
      alpha: one.style === "thin" ? 0.45 : 1,
      dash: one.style === "wall" ? [5, 4] : hatch[map ? 0 : Math.floor(one.colour / 6)],
      points: { show: false },
      paths: map ? () => null : undefined,
      value: (u, value) => record.shown(value),
    }));
    const limited = statuses.find((one) => one.name === "COMMAND_LIMITED");
    const short = statuses.find((one) => one.name === "EFFORT_SHORT");
    const shaded = plot.effort ? limited : plot.actuators && !map ? short : null;
    if (shaded) small.textContent += `; shaded: ${shaded.meaning[0].toLowerCase()}${shaded.meaning.slice(1).replace(/\.$/, "")}`;
    if (map) small.textContent += `; dark: 0, bright: ${record.shown(mostOf(plot, values))} either way`;
    const options = {
      width: Math.max(260, figure.clientWidth),
      height: map ? 40 + 17 * plot.series.length : 210,
      scales: { x: { time: false, min: span[0], max: span[1] }, ...ordinate(plot) },
      series: [{ label: "time [s]", value: (u, value) => record.shown(value, 7) }, ...series],
      axes: [
        { stroke: ink, grid, ticks: grid, font: canvasFont(12), size: 34, values: (u, at) => at.map(tick) },
        {
          scale: "y",
          stroke: ink,
          grid: map ? { show: false } : grid,
          ticks: grid,
          font: canvasFont(12),
          size: GUTTER,
          ...marks(plot),
        },
      ],
      cursor: { sync: { key: "time" }, drag: { x: true, y: false, dist: 4 }, y: false, points: { size: 6 } },
      legend: { live: true },
      hooks: {
        drawClear: shaded ? [(u) => shade(u, shaded.runs)] : [],
        draw: [(u) => (map ? rows(u, plot, times, values) : null), (u) => lines(u, plot, statuses)],
        setScale: [(u, key) => {
          if (key !== "x") return;
          link(u);
          mark(u, now);
        }],
      },
    };
    const held = { plot, figure, u: new uPlot(options, [times, ...values], figure) };
    finish(held);
    return held;
  }

  const tick = (value) => (Math.abs(value) >= 1e5 || (value !== 0 && Math.abs(value) < 1e-3) ? value.toExponential(0) : String(Number(value.toPrecision(6))));

  function finish(held) {
    const { u, figure } = held;
    const line = document.createElement("div");
    line.className = "now";
    u.over.append(line);
    let pressed = null;
    u.over.addEventListener("pointerdown", (event) => (pressed = event.clientX));
    u.over.addEventListener("pointerup", (event) => {
      if (pressed !== null && Math.abs(event.clientX - pressed) < 4) {
        chosen(u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x"));
      }
      pressed = null;
    });
    figure.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const act = { "+": "in", "=": "in", "-": "out", 0: "all", ArrowLeft: "left", ArrowRight: "right" }[event.key];
      if (act) {
        zoom(act);
        event.preventDefault();
      }
    });
  }

  // Statuses: a bar for each, raised where it is filled.
  function timeline(statuses, home) {
    if (!statuses.length) return null;
    const row = 34;
    const draw = (u) => {
      const { left, top, width } = u.bbox;
      const { ctx } = u;
      const ratio = devicePixelRatio;
      statuses.forEach((status, i) => {
        const y = top + i * row * ratio;
        ctx.save();
        ctx.beginPath();
        ctx.rect(left, y, width, row * ratio);
        ctx.clip();
        ctx.fillStyle = record.colour("ink");
        ctx.font = canvasFont(12 * ratio);
        ctx.textBaseline = "top";
        ctx.textAlign = "left";
        ctx.fillText(`${status.name.replaceAll("_", " ").toLowerCase()}, ${record.shown(100 * status.share, 3)} % of samples`, left + 4 * ratio, y + 2 * ratio);
        ctx.fillStyle = record.colour("grid");
        ctx.fillRect(left, y + 18 * ratio, width, 11 * ratio);
        ctx.fillStyle = record.colour(status.gravity === "note" ? "c5" : status.gravity);
        for (const [from, to] of status.runs) {
          const a = u.valToPos(from, "x", true);
          ctx.fillRect(a, y + 18 * ratio, Math.max(ratio, u.valToPos(to, "x", true) - a), 11 * ratio);
        }
        ctx.restore();
      });
    };
    const figure = document.createElement("section");
    figure.className = "plot";
    figure.tabIndex = 0;
    figure.setAttribute("aria-label", `Statuses over time: ${statuses.map((one) => one.name).join(", ")}`);
    home.append(figure);
    const grid = { stroke: record.colour("grid"), width: 1 };
    const options = {
      width: Math.max(260, figure.clientWidth),
      height: row * statuses.length + 44,
      scales: { x: { time: false, min: span[0], max: span[1] }, y: { range: [0, 1] } },
      series: [{}, { paths: () => null, points: { show: false } }],
      axes: [
        { stroke: record.colour("ink"), grid, ticks: grid, font: canvasFont(12), size: 34, values: (u, at) => at.map(tick) },
        { size: GUTTER, grid: { show: false }, ticks: { show: false }, values: () => [] },
      ],
      cursor: { sync: { key: "time" }, drag: { x: true, y: false, dist: 4 }, y: false, points: { show: false } },
      legend: { show: false },
      hooks: { draw: [draw], setScale: [(u, key) => key === "x" && (link(u), mark(u, now))] },
    };
    const held = { plot: null, figure, u: new uPlot(options, [span, [0, 0]], figure) };
    finish(held);
    return held;
  }

  function zoom(act) {
    if (!drawn.length) return;
    const { min, max } = drawn[0].u.scales.x;
    const width = max - min;
    const middle = now !== null && now > min && now < max ? now : (min + max) / 2;
    const to = {
      in: [middle - width / 4, middle + width / 4],
      out: [middle - width, middle + width],
      left: [min - width / 4, max - width / 4],
      right: [min + width / 4, max + width / 4],
      all: span,
    }[act];
    const whole = span[1] - span[0];
    const wide = Math.min(to[1] - to[0], whole);
    const from = Math.min(Math.max(to[0], span[0]), span[1] - wide);
    drawn[0].u.setScale("x", { min: from, max: from + wide });
  }

  function show(scheme, homes) {
    clear();
    span = [scheme.start, scheme.end > scheme.start ? scheme.end : scheme.start + 1];
    const line = timeline(scheme.statuses, homes.statuses);
    if (line) drawn.push(line);
    more(scheme, homes.main, "main");
  }

  function more(scheme, home, group) {
    for (const plot of scheme.plots) if (plot.group === group) drawn.push(make(plot, scheme.statuses, home));
    if (drawn.length > 1) link(drawn[0].u);
    moment(now);
  }

  function clear() {
    for (const one of drawn) {
      one.u.destroy();
      one.figure.remove();
    }
    drawn = [];
  }

  function moment(t) {
    now = t;
    for (const one of drawn) {
      mark(one.u, t);
      // Until a cursor is on the plots their legends tell the sample at the slider.
      if (t !== null && one.plot && one.u.cursor.left < 0) one.u.setLegend({ idx: record.place(one.u.data[0], t) });
    }
  }

  function resize() {
    for (const one of drawn) {
      const width = Math.max(260, one.figure.clientWidth);
      if (width !== one.u.width) one.u.setSize({ width, height: one.u.height });
    }
    moment(now);
  }

  return { show, more, clear, moment, zoom, resize, onChoose: (call) => (chosen = call), all: () => drawn };
})();
