// The panel: one connection, and who shows what comes over it.

import { Actuator } from "./actuator.js";
import { BusView } from "./bus.js";
import { byId, digits, make } from "./dom.js";
import { Faults } from "./faults.js";
import { LoopView } from "./loop.js";
import { Nodes } from "./nodes.js";
import { Record } from "./record.js";
import { Scenarios } from "./scenarios.js";
import { Settings } from "./settings.js";
import { Stream } from "./stream.js";
import { Strips } from "./strips.js";

const TABS = {
  live: { Faults, Settings, Nodes, Bus: BusView, Scenarios, Loop: LoopView },
  view: { Nodes, Bus: BusView, Loop: LoopView },
};
const ENDED = 4001;

let strips, actuator, record, views, shown;

const stream = new Stream({
  onHello(hello) {
    document.title = `${hello.title} – hil-emulator`;
    byId("title").textContent = hello.title;
    strips = new Strips(hello, stream);
    actuator = new Actuator(byId("actuator"), hello);
    views = tabs(hello);
    open(Object.keys(views)[0]);
    if (hello.mode === "live") record = new Record(hello, stream, complain);
    if (hello.mode === "view") byId("recording").append(make("span", { class: "chip" }, "view only"));
  },
  onBuckets(message) {
    strips.take(message);
    if (message.live) {
      actuator.show(message.present);
      byId("clock").textContent = `${digits(message.now, 3)} s`;
    }
  },
  onWords(said) {
    const { status, events } = said;
    if (events?.length) strips.mark(events);
    if (!status) return;
    states(status);
    record?.show(status);
    views[shown].view.show(status, said);
  },
  onEnd(opened, code) {
    const words = code === ENDED ? "The emulator has ended. What is on the strips stays; open the address of the next run for more."
      : opened ? "The connection to the emulator is lost."
      : "No emulator lets this page in: open the address that `hil-emulator run --panel` printed, with all that stands behind its #.";
    complain(words);
    byId("states").replaceChildren(make("span", { class: "chip bad" }, "ended"));
  },
});

function complain(words) {
  byId("notice").textContent = words;
  byId("notice").hidden = false;
}

function tabs(hello) {
  const found = {};
  for (const [name, View] of Object.entries(TABS[hello.mode])) {
    const host = make("div", { hidden: true });
    const button = make("button", {
      type: "button", role: "tab", id: `tab-${name}`, "aria-selected": "false", onclick: () => open(name),
      onkeydown: (event) => step(name, event.key),
    }, name);
    byId("tab").append(host);
    byId("tabs").append(button);
    found[name] = { view: new View(host, hello, stream), host, button };
  }
  return found;
}

function open(name) {
  shown = name;
  for (const [each, { host, button }] of Object.entries(views)) {
    host.hidden = each !== name;
    button.setAttribute("aria-selected", String(each === name));
    button.tabIndex = each === name ? 0 : -1;
  }
  stream.tell({ do: "watch", ...(views[name].view.watching?.() ?? { what: "" }) });
}

// Left and right go through the tabs, as everywhere.
function step(name, key) {
  const names = Object.keys(views);
  const by = { ArrowRight: 1, ArrowLeft: -1 }[key];
  if (!by) return;
  const next = names[(names.indexOf(name) + by + names.length) % names.length];
  open(next);
  views[next].button.focus();
}

function states({ nodes = [], faults = [], timing, slipped }) {
  byId("states").replaceChildren(
    ...nodes.map(({ id, state }) => make("span", {
      class: `chip ${state === "operational" ? "good" : ""}`,
    }, `node ${id} ${state.replace("_", "-")}`)),
    faults.length ? make("span", { class: "chip bad" }, `${faults.length} fault${faults.length > 1 ? "s" : ""}`) : "");
  if (timing) byId("health").textContent = `${timing.late} late, ${digits(slipped ?? 0, 3)} s behind the wall`;
}

function theme(chosen) {
  document.documentElement.dataset.theme = chosen;
  byId("theme").textContent = chosen === "dark" ? "Light" : "Dark";
  strips?.charts.forEach((chart) => chart.plot.redraw(false));
}

byId("theme").onclick = () => {
  const chosen = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  localStorage.setItem("theme", chosen);
  theme(chosen);
};
theme(localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
