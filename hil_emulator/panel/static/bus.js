// The bus: load, frames per second, a line per identifier, or a trace in words with a filter.

import { digits, make, overdue, plain } from "./dom.js";

const MOST = 500;

export class BusView {
  constructor(host, hello, stream) {
    this.stream = stream;
    this.rate = hello.bit_rate;
    this.passes = !hello.logs; // time, which it does not in a recording
    this.what = "identifiers";
    this.load = make("p");
    const choice = (what, text) => make("button", {
      type: "button", "aria-pressed": String(what === this.what), onclick: () => this.choose(what),
    }, text);
    this.choices = { identifiers: choice("identifiers", "By identifier"), trace: choice("trace", "Trace") };
    this.filter = make("input", { type: "text", placeholder: "Filter: tpdo1, emcy, 185, rx", "aria-label": "Filter", style: "width:12rem", oninput: () => this.restart() });
    this.held = make("button", { type: "button", "aria-pressed": "false", onclick: () => this.hold() }, "Pause");
    this.body = make("tbody");
    this.head = make("tr");
    host.append(this.load,
      make("div", { class: "row" }, this.choices.identifiers, this.choices.trace, this.held),
      make("div", { class: "row" }, this.filter),
      make("div", { class: "scroll", tabindex: "0" }, make("table", {}, make("thead", {}, this.head), this.body)));
    this.titles();
  }

  watching() { return { what: this.what, filter: this.filter.value.trim() }; }

  choose(what) {
    this.what = what;
    for (const [name, button] of Object.entries(this.choices)) button.setAttribute("aria-pressed", String(name === what));
    this.titles();
    this.restart();
  }

  titles() {
    const titles = this.what === "trace" ? ["time", "", "id", "data, in words"] : ["id", "", "period", "data, in words"];
    this.head.replaceChildren(...titles.map((title) => make("th", {}, title)));
  }

  restart() {
    this.body.replaceChildren();
    if (this.held.getAttribute("aria-pressed") === "false") this.stream.tell({ do: "watch", ...this.watching() });
  }

  hold() {
    const held = this.held.getAttribute("aria-pressed") === "false";
    this.held.setAttribute("aria-pressed", String(held));
    this.stream.tell(held ? { do: "watch", what: "" } : { do: "watch", ...this.watching() });
  }

  show({ bus = {}, bus_load: measured }, { bus: seen, identifiers, trace }) {
    const load = measured ?? seen.load;
    this.load.textContent = `Load ${digits(100 * load, 1)} % of ${this.rate / 1000} kbit/s${measured == null ? " (worst-case stuffing)" : ""}, ` +
      `${seen.rate} frames/s${bus.dropped ? `, ${bus.dropped} dropped` : ""}`;
    if (identifiers && this.what === "identifiers") this.table(identifiers);
    if (trace && this.what === "trace") this.append(trace);
  }

  table(lines) {
    const wanted = this.filter.value.trim().toLowerCase();
    const shown = lines.filter((line) => `${line.id} ${line.data} ${line.words} ${way(line)}`.toLowerCase().includes(wanted));
    while (this.body.rows.length > shown.length) this.body.lastChild.remove();
    shown.forEach((line, i) => {
      const row = this.body.rows[i] ?? this.body.insertRow();
      const late = this.passes ? overdue(line) : "";
      row.className = late ? "stale" : "";
      fill(row, [line.id, way(line), late || (line.period ? `${plain(line.period * 1e3)} ms` : `${line.count}×`)], line);
    });
  }

  append(lines) {
    for (const line of lines) {
      fill(this.body.insertRow(0), [line.time.toFixed(3), way(line), line.id], line);
    }
    while (this.body.rows.length > MOST) this.body.lastChild.remove();
  }
}

// Writes the first cells, and the data with its meaning below into the last one.
function fill(row, texts, { data, words }) {
  [...texts, null].forEach((text, j) => {
    const cell = row.cells[j] ?? row.insertCell();
    if (text === null) {
      if (!cell.children.length) cell.append(make("span", { class: "mono" }), make("span", { class: "note" }));
      cell.children[0].textContent = data;
      cell.children[1].textContent = words;
    } else {
      cell.className = "mono";
      cell.textContent = text;
    }
  });
}

const way = ({ sent }) => (sent ? "tx" : "rx");
