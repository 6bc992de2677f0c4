// Faults: the whole catalogue with fields, units, bounds and defaults; the running ones.

import { digits, make } from "./dom.js";

const COMMON = [
  ["start", "from now on, such as 2 s"], ["duration", "such as 3 s; until ended"],
  ["ramp", "time to full strength, such as 1 s"], ["probability", "of acting, 0 to 1"],
  ["seed", "of chances, a whole number"], ["condition", "such as position > 60 mm"],
];

export class Faults {
  constructor(host, hello, stream) {
    this.stream = stream;
    this.catalogue = hello.faults;
    this.target = make("select", { "aria-label": "What breaks", onchange: () => this.pickTarget() },
      hello.faults.map(({ target }) => make("option", {}, target)));
    this.other = make("input", { type: "text", placeholder: `node${hello.nodes[0]}.tpdo1`, "aria-label": "Another target" });
    this.kinds = make("div", { class: "kinds", role: "group", "aria-label": "How" });
    this.meaning = make("p", { class: "note" });
    this.fields = make("div", { class: "fields" });
    this.common = make("div", { class: "fields" }, COMMON.flatMap(([name, hint]) => [
      make("label", { for: `f-${name}` }, name),
      make("input", { type: "text", id: `f-${name}`, name, placeholder: hint, style: "width:100%" }),
    ]));
    this.inject = make("button", { type: "submit", class: "main" }, "Inject");
    this.trouble = make("p", { class: "bad", role: "alert" });
    this.running = make("ul", { class: "list", id: "running" });
    this.all = make("button", { type: "button", onclick: () => this.end() }, "End all");
    this.injected = make("section", { hidden: true }, make("h3", { style: "margin-top:0" }, "Injected"), this.running,
      make("div", { class: "row" }, this.all));
    host.append(this.injected,
      make("form", { novalidate: true, onsubmit: (event) => { event.preventDefault(); this.go(); } },
        make("div", { class: "row" }, make("label", {}, "Target ", this.target), this.other),
        this.kinds, this.meaning, this.fields,
        make("details", {}, make("summary", {}, "When, how likely"), this.common),
        make("div", { class: "row" }, this.inject), this.trouble));
    this.pickTarget();
  }

  pickTarget() {
    const { kinds } = this.catalogue.find(({ target }) => target === this.target.value);
    this.kinds.replaceChildren(...kinds.map((kind) => make("button", {
      type: "button", "aria-pressed": "false", onclick: (event) => this.pickKind(kind, event.currentTarget),
    }, kind.name.replaceAll("_", " "))));
    this.pickKind(kinds[0], this.kinds.firstChild);
  }

  pickKind(kind, button) {
    this.kind = kind;
    for (const each of this.kinds.children) each.setAttribute("aria-pressed", String(each === button));
    this.meaning.textContent = `${kind.meaning}.`;
    this.trouble.textContent = "";
    this.fields.replaceChildren(...kind.params.flatMap((param) => field(param)));
  }

  async go() {
    const given = { target: this.other.value.trim() || this.target.value, kind: this.kind.name };
    for (const input of this.fields.querySelectorAll("[name]")) {
      const unit = input.dataset.unit;
      if (input.value === "") return this.refuse(input); // empty, or no number
      given[input.name] = unit ? `${input.value} ${unit}` : input.value;
    }
    for (const input of this.common.querySelectorAll("input")) {
      if (input.value.trim()) given[input.name] = input.value.trim();
    }
    await this.attempt({ do: "fault", ...given });
  }

  refuse(input) {
    const { name, usual, unit } = input.dataset;
    this.trouble.textContent = `${name}: write a number, such as ${usual}${unit ? ` ${unit}` : ""}. Nothing was injected.`;
    input.setAttribute("aria-invalid", "true");
    input.focus();
  }

  end(number) {
    return this.attempt(number === undefined ? { do: "end" } : { do: "end", number });
  }

  async attempt(request) {
    this.trouble.textContent = "";
    try {
      await this.stream.ask(request);
    } catch (error) {
      this.trouble.textContent = error.message;
    }
  }

  // Shows the running ones; keeps the buttons that are there, so that none moves under a click.
  show({ faults = [] }) {
    const kept = new Map([...this.running.children].map((line) => [Number(line.dataset.number), line]));
    for (const [number, line] of kept) {
      if (!faults.some((fault) => fault.number === number)) line.remove();
    }
    for (const { number, fault, began, left } of faults) {
      let line = kept.get(number);
      if (!line) {
        line = make("li", { "data-number": number }, make("span", {}, fault), make("output"),
          make("button", { type: "button", onclick: () => this.end(number) }, "End"));
        this.running.append(line);
      }
      const time = left == null ? "until ended" : `${digits(left, 1)} s left`;
      line.children[1].textContent = began ? time : "waits";
    }
    this.injected.hidden = !faults.length;
  }
}

function field({ name, meaning, unit, low, high, choices, default: usual }) {
  const label = make("label", { for: `p-${name}`, title: meaning }, name);
  if (choices) {
    return [label, make("select", { id: `p-${name}`, name }, choices.map((each) => make("option", {}, each)))];
  }
  const bounds = `${low ?? "−∞"} … ${high ?? "∞"} ${unit}`;
  return [label, make("span", { class: "amount" },
    make("input", {
      id: `p-${name}`, name, type: "number", step: "any", value: usual, title: meaning, "data-unit": unit,
      "data-name": name, "data-usual": usual, oninput: ({ target }) => target.removeAttribute("aria-invalid"),
    }),
    unit, make("span", { class: "note" }, bounds))];
}
