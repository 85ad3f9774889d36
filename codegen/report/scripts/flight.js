"use strict";
// The page of a flight: which scheme is shown, the slider, the numbers beside it.
(async () => {
  const data = record.told("data");
  const by = (id) => document.getElementById(id);
  await record.open();
  if (!data.schemes.length) return;
  const slider = by("slider");
  let scheme = data.schemes[0];
  let times = [];
  let cells = [];
  let playing = null;

  function numbers() {
    const body = by("numbers");
    body.replaceChildren();
    cells = [];
    for (const one of scheme.numbers) {
      if (one.signal === "time") continue;
      const row = document.createElement("tr");
      const head = document.createElement("th");
      head.scope = "row";
      head.textContent = `${one.label}${one.unit ? ` [${one.unit}]` : ""}`;
      const cell = document.createElement("td");
      cell.className = "number";
      cell.dataset.signal = one.signal;
      row.append(head, cell);
      body.append(row);
      cells.push({ one, cell });
    }
  }

  function moment(i) {
    slider.value = i;
    const t = times[i];
    by("clock").textContent = `${record.shown(t, 7)} s`;
    slider.setAttribute("aria-valuetext", `${record.shown(t, 7)} seconds`);
    for (const { one, cell } of cells) {
      const values = one.a.map((number) => record.column(number)[i]);
      cell.textContent = values.map((value) => (value === null ? "–" : record.shown(value * one.scale))).join(" ");
    }
    const bits = scheme.bits ? (record.column(scheme.bits[0])[i] ?? 0) : 0;
    const raised = scheme.statuses.filter((one) => Math.floor(bits / one.bit) % 2 === 1);
    by("raised").textContent = raised.length ? raised.map((one) => one.name.replaceAll("_", " ").toLowerCase()).join(", ") : "no status raised";
    plots.moment(t);
    space.moment(i);
  }

  const nearest = (t) => {
    const i = record.place(times, t);
    return i + 1 < times.length && times[i + 1] - t < t - times[i] ? i + 1 : i;
  };

  function stop() {
    if (playing !== null) cancelAnimationFrame(playing);
    playing = null;
    by("play").textContent = "Play";
  }

  function play() {
    if (playing !== null) return stop();
    by("play").textContent = "Pause";
    let t = Number(slider.value) >= times.length - 1 ? times[0] : times[Number(slider.value)];
    let before = performance.now();
    const step = (at) => {
      const speed = by("speed").value === "whole" ? (scheme.end - scheme.start) / 20 : Number(by("speed").value);
      t += ((at - before) / 1000) * speed;
      before = at;
      moment(record.place(times, t));
      if (t >= scheme.end) return stop();
      playing = requestAnimationFrame(step);
      return undefined;
    };
    playing = requestAnimationFrame(step);
  }

  function show(number) {
    stop();
    const share = times.length > 1 ? Number(slider.value) / (times.length - 1) : 0;
    scheme = data.schemes[number];
    times = record.column(scheme.moments[0]);
    slider.max = times.length - 1;
    numbers();
    plots.show(scheme, { main: by("plots"), statuses: by("statuses") });
    by("no-status").hidden = scheme.statuses.length > 0;
    const others = scheme.plots.some((one) => one.group === "other");
    by("others").hidden = !others;
    if (by("others").open) plots.more(scheme, by("other-plots"), "other");
    const seen = space.show(by("view"), scheme);
    by("still").toggleAttribute("hidden", seen);
    by("no-webgl").hidden = seen;
    by("no-webgl").textContent = scheme.scene ? "This browser offers no WebGL: a still picture of the start is shown instead." : "What would be seen in space is not known of this flight.";
    moment(Math.round(share * (times.length - 1)));
  }

  slider.addEventListener("input", () => {
    stop();
    moment(Number(slider.value));
  });
  plots.onChoose((t) => {
    stop();
    moment(nearest(t));
  });
  by("play").addEventListener("click", play);
  for (const button of document.querySelectorAll("[data-zoom]")) button.addEventListener("click", () => plots.zoom(button.dataset.zoom));
  for (const button of document.querySelectorAll("[data-near]")) button.addEventListener("click", () => space.look("near", Number(button.dataset.near)));
  for (const radio of document.querySelectorAll("input[name=scheme]")) radio.addEventListener("change", () => show(Number(radio.value)));
  for (const link of document.querySelectorAll("[data-at]")) {
    link.addEventListener("click", () => moment(nearest(Number(link.dataset.at))));
  }
  by("others").addEventListener("toggle", () => {
    if (by("others").open && !plots.all().some((one) => one.plot && one.plot.group === "other")) plots.more(scheme, by("other-plots"), "other");
  });
  space.hold(by("view"));
  addEventListener("resize", () => {
    plots.resize();
    space.touch();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => show(data.schemes.indexOf(scheme)));
  show(0);
  // For whoever looks at the page from the console, and for its tests.
  globalThis.report = { data, record, plots, space, moment, nearest, ready: performance.now() };
  document.documentElement.dataset.ready = "yes";
})();
