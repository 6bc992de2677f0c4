// The strip charts: one per unit, with the signals that are chosen; live, paused or zoomed.

import { Buckets } from "./buckets.js";
import { byId, colour, digits, make, placesFor, save } from "./dom.js";

const COLOURS = ["--s1", "--s2", "--s3", "--s4", "--s5", "--s6"];
const LEAST = { mm: 1, bar: 5, N: 50, mA: 0.2, "mm/s": 5, "l/min": 0.2, "µs": 50 };
const USUAL = [
  "position", "model.position", "load_force", "model.load_force", "pressure_a", "pressure_b",
  "supply_pressure", "valve_current", "model.spool_position",
];
const HEIGHT = 126, HIGHEST = 480; // of a strip
const BELOW = 22, LEGEND = 36, END = 70; // time axis, above each strip, below all of them
const MOST_PIXELS = 4096; // as protocol/page.py has it

export class Strips {
  constructor(hello, stream) {
    this.hello = hello;
    this.stream = stream;
    this.known = new Map(hello.columns.map((column, index) => [column.name, { ...column, index }]));
    this.marks = [];
    this.hidden = new Set();
    this.span = 10;
    this.window = null; // [from, to] where a part of the past is shown
    this.now = 0;
    this.generation = 0;
    this.cost = 0;
    this.still = hello.span ?? null; // the whole of what is over
    this.window = this.whole = this.still;
    this.names = this.remembered();
    this.build();
    this.wire();
  }

  remembered() {
    try {
      const kept = JSON.parse(localStorage.getItem(`strips ${this.hello.mode}`)) ?? [];
      const names = kept.filter((name) => this.known.has(name));
      if (names.length) return names;
    } catch { /* nothing was kept */ }
    const all = [...this.known.keys()].filter((name) => name !== "time");
    return this.hello.mode === "found" ? all : USUAL.filter((name) => this.known.has(name));
  }

  wire() {
    byId("span").onchange = (event) => { this.span = Number(event.target.value); this.live(); };
    byId("pause").onclick = () => (this.still ? this.play() : this.window ? this.live() : this.pause());
    if (this.still) byId("pause").textContent = "Play";
    byId("span").parentElement.hidden = Boolean(this.still);
    byId("back").onclick = () => this.back();
    byId("picture").onclick = () => this.picture();
    byId("data").onclick = () => this.table();
    byId("choose").onclick = () => this.choose();
    let resizing = 0;
    new ResizeObserver(() => {
      clearTimeout(resizing);
      resizing = setTimeout(() => this.resize(), 150);
    }).observe(byId("charts"));
    document.addEventListener("keydown", (event) => {
      if (event.key === " " && event.target === document.body) {
        event.preventDefault();
        byId("pause").click();
      }
    });
  }

  // One strip per unit, in the order in which the signals were chosen.
  build() {
    this.charts?.forEach((chart) => chart.plot.destroy());
    byId("charts").replaceChildren();
    this.buckets = new Buckets(this.names);
    this.scales = this.names.map((name) => this.known.get(name).scale);
    const units = [...new Set(this.names.map((name) => this.known.get(name).unit))];
    this.height = this.fitting(units.length);
    this.charts = units.map((unit, place) => this.strip(unit, place === units.length - 1));
    this.window ? this.ask() : this.live();
  }

  // The height of each strip with which all of them fill the window, where that is high enough.
  fitting(count) {
    const free = innerHeight - byId("charts").offsetTop - BELOW - END;
    return Math.max(HEIGHT, Math.min(HIGHEST, Math.floor(free / count) - LEGEND));
  }

  strip(unit, last) {
    const names = this.names.filter((name) => this.known.get(name).unit === unit);
    const legend = make("div", { class: "legend" }, make("span", { class: "unit" }, unit || "1"));
    const outputs = names.map((name, i) => {
      const output = make("output");
      const pressed = !this.hidden.has(name);
      const line = make("i", { class: dashed(name) ? "dashed" : "" });
      line.style.borderColor = `var(${COLOURS[i % COLOURS.length]})`;
      legend.append(make("button", {
        type: "button", "aria-pressed": String(pressed), title: "Show or hide",
        onclick: (event) => this.toggle(name, event.currentTarget),
      }, line, name, output));
      return output;
    });
    const body = make("div");
    body.setAttribute("role", "img");
    body.setAttribute("aria-label", `${names.join(", ")} over time, in ${unit || "1"}`);
    byId("charts").append(make("div", { class: "strip", "data-unit": unit }, legend, body));
    const chart = { unit, names, outputs, body, places: 2, at: names.map((name) => this.names.indexOf(name)) };
    chart.plot = new uPlot(this.options(chart, last), [[], ...names.map(() => [])], body);
    return chart;
  }

  options(chart, last) {
    const axis = {
      stroke: () => colour("--faint"), grid: { stroke: () => colour("--line"), width: 1 },
      ticks: { stroke: () => colour("--line"), width: 1, size: 4 }, font: "12px system-ui, sans-serif",
    };
    return {
      width: Math.max(200, chart.body.clientWidth), height: this.height + (last ? BELOW : 0),
      legend: { show: false }, scales: {
        x: { time: false, auto: false }, y: { range: (_, low, high) => padded(low, high, (LEAST[chart.unit] ?? 1e-3) / (this.still ? 20 : 1)) },
      },
      cursor: {
        sync: { key: "strips" }, drag: { x: true, y: false, setScale: false }, points: { size: 5 },
        bind: { dblclick: () => () => { this.back(); return null; } },
      },
      series: [{}, ...chart.names.map((name, i) => ({
        stroke: () => colour(COLOURS[i % COLOURS.length]), width: 1.4, dash: dashed(name) ? [5, 6] : undefined,
        points: { show: false }, show: !this.hidden.has(name),
      }))],
      axes: [
        { ...axis, show: true, size: last ? 34 : 12, values: last ? (_, ticks) => ticks.map((t) => `${+t.toFixed(3)} s`) : () => [] },
        { ...axis, size: 56, space: 24, values: (_, ticks) => labels(ticks) },
      ],
      hooks: {
        setSelect: [(plot) => this.selected(plot)],
        setCursor: [(plot) => {
          this.read(chart);
          if (chart === this.charts?.[0] && plot.cursor.idx != null) this.onTime?.(plot.data[0][plot.cursor.idx]);
        }],
        draw: [(plot) => this.drawMarks(plot)],
      },
    };
  }

  pixels() {
    return Math.min(MOST_PIXELS, Math.max(100, Math.round((this.charts[0]?.plot.bbox.width ?? 800) / devicePixelRatio)));
  }

  live() {
    if (this.still) return this.show(this.still);
    this.window = null;
    this.zoomed = false;
    byId("pause").textContent = "Pause";
    byId("pause").setAttribute("aria-pressed", "false");
    byId("back").disabled = true;
    this.buckets.clear();
    this.stream.tell({
      do: "view", columns: this.names.join(" "), span: this.span, pixels: this.pixels(),
      generation: ++this.generation,
    });
  }

  pause() {
    this.show([Math.max(0, this.now - this.span), this.now]);
    this.whole = this.window;
  }

  show(window) {
    this.window = window;
    if (!this.still) {
      byId("pause").textContent = "Go on";
      byId("pause").setAttribute("aria-pressed", "true");
    }
    this.ask();
  }

  // Lets the cursor pass over the strips at the pace of the wall; a second click holds it.
  play() {
    this.playing = !this.playing;
    byId("pause").textContent = this.playing ? "Hold" : "Play";
    const plot = this.charts[0].plot;
    let time = plot.cursor.idx == null ? this.window[0] : plot.data[0][plot.cursor.idx];
    let last = performance.now();
    const step = (now) => {
      if (!this.playing) return;
      time += (now - last) / 1000;
      last = now;
      if (time > this.window[1]) time = this.window[0];
      for (const { plot } of this.charts) plot.setCursor({ left: plot.valToPos(time, "x"), top: 5 });
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  turn(hello) {
    this.hello = hello;
    this.known = new Map(hello.columns.map((column, index) => [column.name, { ...column, index }]));
    this.window = this.whole = this.still = hello.span;
    this.marks = [];
    this.names = this.remembered();
    this.build();
  }

  ask() {
    this.stream.tell({
      do: "view", columns: this.names.join(" "), from: this.window[0], to: this.window[1],
      pixels: this.pixels(), generation: ++this.generation,
    });
  }

  selected(plot) {
    const { left, width } = plot.select;
    if (width < 4) return;
    const ends = [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")];
    plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    if (!this.window) this.whole = [Math.max(0, this.now - this.span), this.now];
    byId("back").disabled = false;
    this.zoomed = true;
    this.show(ends);
  }

  back() {
    if (!this.zoomed) return;
    this.zoomed = false;
    byId("back").disabled = true;
    this.show(this.whole);
  }

  resize() {
    this.height = this.fitting(this.charts.length);
    for (const [i, chart] of this.charts.entries()) {
      const height = this.height + (i === this.charts.length - 1 ? BELOW : 0);
      chart.plot.setSize({ width: Math.max(200, chart.body.clientWidth), height });
    }
    this.window ? this.ask() : this.live();
  }

  take(message) {
    if (message.live) this.now = message.now;
    if (message.generation !== this.generation) return;
    this.buckets.take(message, this.span);
    this.fresh = message;
    if (!this.painting) {
      this.painting = true;
      setTimeout(() => requestAnimationFrame(() => this.paint()), this.cost);
    }
  }

  // Draws what came last, and rests as long as that took, so that a slow machine is not filled.
  paint() {
    this.painting = false;
    const begin = performance.now();
    const [from, to] = this.window ?? [this.now - this.span, this.now];
    const [x, ys] = this.buckets.lines(from, this.scales);
    for (const chart of this.charts) {
      chart.plot.batch(() => {
        chart.plot.setData([x, ...chart.at.map((i) => ys[i])], false);
        chart.plot.setScale("x", { min: from, max: to });
      });
      this.read(chart);
    }
    this.cost = Math.max(0, Math.min(200, performance.now() - begin - 8));
    if (this.fresh?.live) this.stream.tell({ do: "painted", number: this.fresh.number });
  }

  // Writes the values under the cursor, or else the last ones.
  read(chart) {
    const { plot } = chart;
    const count = plot.data[0].length;
    const at = plot.cursor.idx ?? (this.still ? 0 : count - 1); // the actuator shows the same time
    const { min, max } = plot.scales.y;
    chart.places = placesFor((max - min) / 5);
    chart.outputs.forEach((output, i) => {
      output.textContent = count ? digits(plot.data[i + 1][at], chart.places) : "–";
    });
  }

  toggle(name, button) {
    this.hidden.has(name) ? this.hidden.delete(name) : this.hidden.add(name);
    const shown = !this.hidden.has(name);
    button.setAttribute("aria-pressed", String(shown));
    const chart = this.charts.find((each) => each.names.includes(name));
    chart.plot.setSeries(chart.names.indexOf(name) + 1, { show: shown });
  }

  mark(events) {
    this.marks.push(...events.map(([, time, words]) => ({ time, words })));
    this.marks.splice(0, this.marks.length - 500);
  }

  drawMarks(plot) {
    const { ctx, bbox } = plot;
    const { min, max } = plot.scales.x;
    const first = plot === this.charts?.[0]?.plot;
    ctx.save();
    ctx.strokeStyle = ctx.fillStyle = colour("--bad");
    ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    ctx.textAlign = "left";
    ctx.textBaseline = "top";
    ctx.setLineDash([3, 3]);
    let free = -Infinity;
    for (const { time, words } of this.marks) {
      if (time < min || time > max) continue;
      const x = plot.valToPos(time, "x", true);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      if (first && x > free) {
        ctx.fillText(words, x - 1, bbox.top - 14 * devicePixelRatio);
        free = x + 10 + ctx.measureText(words).width;
      }
    }
    ctx.restore();
  }

  choose() {
    const offer = byId("offer"), find = byId("find");
    const fill = () => {
      offer.replaceChildren();
      const units = [...new Set(this.hello.columns.map((column) => column.unit))];
      for (const unit of units) {
        const found = this.hello.columns.filter((column) =>
          column.unit === unit && column.name !== "time" && column.name.includes(find.value));
        if (found.length) offer.append(make("h3", {}, unit || "without a unit"));
        offer.append(...found.map(({ name }) => make("label", {}, make("input", {
          type: "checkbox", checked: this.names.includes(name),
          onchange: (event) => this.pick(name, event.target.checked),
        }), ` ${name}`)));
      }
    };
    find.value = "";
    find.oninput = fill;
    fill();
    byId("signals").showModal();
  }

  pick(name, wanted) {
    this.names = wanted ? [...this.names, name] : this.names.filter((each) => each !== name);
    if (!this.names.length) this.names = [name];
    localStorage.setItem(`strips ${this.hello.mode}`, JSON.stringify(this.names));
    this.build();
  }

  // All strips below each other, as they are on the screen.
  picture() {
    const canvases = this.charts.map((chart) => chart.plot.ctx.canvas);
    const all = make("canvas");
    const head = 22 * devicePixelRatio;
    all.width = Math.max(...canvases.map((canvas) => canvas.width));
    all.height = canvases.reduce((sum, canvas) => sum + canvas.height + head, 0);
    const ctx = all.getContext("2d");
    ctx.fillStyle = colour("--card");
    ctx.fillRect(0, 0, all.width, all.height);
    ctx.font = `${13 * devicePixelRatio}px system-ui, sans-serif`;
    let y = 0;
    for (const [i, chart] of this.charts.entries()) {
      let x = 8 * devicePixelRatio;
      for (const [j, text] of [`${chart.unit}   `, ...chart.names].entries()) {
        ctx.fillStyle = j ? colour(COLOURS[(j - 1) % COLOURS.length]) : colour("--ink");
        ctx.fillText(text, x, y + 16 * devicePixelRatio);
        x += ctx.measureText(`${text}   `).width;
      }
      ctx.drawImage(canvases[i], 0, y + head);
      y += canvases[i].height + head;
    }
    all.toBlob((blob) => save(`${this.hello.title}.png`, blob));
  }

  // Least and greatest value per bucket, as they are on the screen.
  table() {
    const { low, high, length, begin, width } = this.buckets;
    const [from, to] = this.window ?? [this.now - this.span, this.now];
    const titles = this.names.flatMap((name) => {
      const { unit } = this.known.get(name);
      return [`${name} least [${unit || 1}]`, `${name} greatest [${unit || 1}]`];
    });
    const lines = [["time [s]", ...titles].join(",")];
    for (let i = 0; i < length; i++) {
      const time = begin + i * width;
      if (time < from - width || time > to || Number.isNaN(low[0][i])) continue;
      const cells = this.names.flatMap((_, c) => [low[c][i] / this.scales[c], high[c][i] / this.scales[c]]);
      lines.push([time.toFixed(4), ...cells.map((cell) => +cell.toPrecision(7))].join(","));
    }
    save(`${this.hello.title}.csv`, new Blob([lines.join("\n") + "\n"], { type: "text/csv" }));
  }
}

const dashed = (name) => name.startsWith("model.") || name.endsWith(".configured");

// Writes ticks with all their places, 2.5 and 0.025 with one more, and no minus before a zero.
function labels(ticks) {
  const step = ticks.length > 1 ? Math.abs(ticks[1] - ticks[0]) : 1;
  let places = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
  if (Math.abs(step * 10 ** places - Math.round(step * 10 ** places)) > 0.01) places += 1;
  return ticks.map((tick) => digits(Math.abs(tick) < step / 1e3 ? 0 : tick, Math.min(places, 9)));
}

function padded(low, high, least) {
  if (low == null || !Number.isFinite(low) || !Number.isFinite(high)) return [0, least];
  const middle = (low + high) / 2, half = Math.max((high - low) * 0.56, least / 2);
  return [middle - half, middle + half];
}
