// The timing of the loop: how late its ticks began, how long they took, how old the picture is.

import { digits, make } from "./dom.js";

export class LoopView {
  constructor(host, hello) {
    this.tick = hello.tick;
    this.body = make("tbody");
    this.notes = make("p", { class: "note" });
    const recorded = hello.columns.every(({ name }) => name !== "loop.lateness");
    host.append(...(recorded ? [] : [make("table", {}, make("thead", {}, make("tr", {}, make("th", {}, "last 10 s"),
      ...["p50", "p99", "max"].map((title) => make("th", { class: "number" }, title)))), this.body),
      make("p", { class: "note" }, "loop.lateness and loop.execution are signals: choose them for a strip.")]), this.notes,
      make("p", { class: "note" }, Object.entries(hello.provenance).map(([name, text]) => `${name} ${text}`).join(", ")));
  }

  watching() { return { what: "loop" }; }

  show({ timing, slipped }, { loop, latency }) {
    if (loop) {
      this.body.replaceChildren(...Object.entries(loop).map(([name, values]) => make("tr", {}, make("td", {}, name),
        ...values.map((value) => make("td", { class: "number" }, `${digits(value * 1e6, 0)} µs`)))));
    }
    const parts = [`Period ${this.tick * 1e3} ms`];
    if (timing) parts.push(`${timing.ticks} ticks, ${timing.late} late`, `${digits(slipped ?? 0, 3)} s behind the wall`);
    if (latency?.length) {
      const [median, longest] = latency.map((age) => digits(age * 1e3, 0));
      parts.push(`from a tick to the screen and back ${median} ms (median), ${longest} ms at most`);
    }
    this.notes.textContent = `${parts.join("; ")}.`;
  }
}
