// The nodes: NMT state, last emergency in words, PDOs with live values; NMT and SDO by hand.

import { make, overdue, plain } from "./dom.js";

const COMMANDS = ["start", "stop", "pre-operational", "reset", "reset communication"];

export class Nodes {
  constructor(host, hello, stream) {
    this.stream = stream;
    this.can = hello.mode === "live";
    this.passes = !hello.logs; // time, which it does not in a recording
    this.host = make("div");
    this.cards = new Map();
    host.append(this.host);
    if (this.can) host.append(this.objects());
  }

  watching() { return { what: "nodes" }; }

  show({ nodes: states = [] }, { nodes = [] }) {
    if (!nodes.length) return;
    for (const node of nodes) {
      const id = Number(node.name.replace("node", ""));
      const card = this.cards.get(id) ?? this.card(id);
      const state = states.find((each) => each.id === id)?.state;
      card.state.textContent = (state ?? "recorded").replace("_", "-").toUpperCase();
      card.state.className = `chip ${state === "operational" ? "good" : ""}`;
      const { emergency } = node;
      card.emergency.textContent = emergency ? `Last emergency at ${emergency.time.toFixed(3)} s: ${emergency.words}` : "No emergency seen.";
      card.emergency.className = emergency && !emergency.words.startsWith("no error") ? "bad" : "note";
      this.fill(card.body, node.pdos);
    }
  }

  card(id) {
    const card = {
      state: make("span", { class: "chip" }), emergency: make("p", { class: "note" }), body: make("tbody"),
    };
    const buttons = this.can ? make("div", { class: "row" }, COMMANDS.map((command) => make("button", {
      type: "button", onclick: () => this.nmt(command, id),
    }, command))) : null;
    this.host.append(make("section", { "data-node": id },
      make("h3", {}, `Node ${id} `, card.state), card.emergency, buttons,
      make("div", { class: "scroll" }, make("table", {},
        make("thead", {}, make("tr", {}, ...["PDO", "object"].map((t) => make("th", {}, t)), make("th", { class: "number" }, "value"))),
        card.body))));
    if (this.node) this.node.value ||= id;
    this.cards.set(id, card);
    return card;
  }

  fill(body, pdos) {
    const rows = pdos.flatMap((pdo) => {
      const late = this.passes ? overdue(pdo) : "";
      const pace = late || (pdo.period ? `${plain(pdo.period * 1e3)} ms` : "");
      return pdo.fields.map((field, i) => [i ? "" : `${pdo.name} ${pdo.id} ${pace}`, field.name, `${plain(field.value)} ${field.unit}`, late]);
    });
    while (body.rows.length > rows.length) body.lastChild.remove();
    rows.forEach((cells, i) => {
      const row = body.rows[i] ?? body.insertRow();
      row.className = cells[3] ? "stale" : "";
      cells.slice(0, 3).forEach((text, j) => {
        const cell = row.cells[j] ?? row.insertCell();
        if (j === 2) cell.className = "number";
        if (cell.textContent !== text) cell.textContent = text;
      });
    });
  }

  async nmt(command, node) {
    this.report(() => this.stream.ask({ do: "nmt", command, node }), `NMT ${command}, node ${node}: sent`);
  }

  objects() {
    const input = (name, width, value = "") => make("input", { type: "text", "aria-label": name, placeholder: name, value, style: `width:${width}rem` });
    this.node = input("node", 3.5);
    this.index = input("index", 5.5, "0x1008");
    this.subindex = input("sub", 3.5, "0");
    this.value = input("value", 8);
    this.outcome = make("p", { role: "status", class: "mono", style: "white-space:normal" });
    const place = () => ({ do: "sdo", node: Number(this.node.value), index: this.index.value, subindex: this.subindex.value });
    return make("form", { onsubmit: (event) => { event.preventDefault(); this.report(() => this.stream.ask(place())); } },
      make("h3", {}, "SDO by hand"),
      make("div", { class: "row" }, this.node, this.index, this.subindex, make("button", { type: "submit" }, "Read")),
      make("div", { class: "row" }, this.value, make("button", {
        type: "button", onclick: () => this.report(() => this.stream.ask({ ...place(), value: this.value.value })),
      }, "Write")), this.outcome);
  }

  async report(act, done = "") {
    this.outcome.className = "mono";
    this.outcome.textContent = "…";
    try {
      const answer = await act();
      this.outcome.textContent = done || answer.text;
    } catch (error) {
      this.outcome.className = "bad";
      this.outcome.textContent = error.message;
    }
  }
}
