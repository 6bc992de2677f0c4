// The panel: one connection, and who shows what comes over it.

import { Actuator } from "./actuator.js";
import { BusView } from "./bus.js";
import { byId, digits, make } from "./dom.js";
import { Faults } from "./faults.js";
import { LoopView } from "./loop.js";
import { Nodes } from "./nodes.js";
import { Record } from "./record.js";
import { Result } from "./result.js";
import { Scenarios } from "./scenarios.js";
import { Settings } from "./settings.js";
import { Stream } from "./stream.js";
import { Strips } from "./strips.js";

const TABS = {
  live: { Faults, Settings, Nodes, Bus: BusView, Scenarios, Loop: LoopView },
  recorded: { Nodes, Bus: BusView, About: LoopView },
  found: { Result },
  view: { Nodes, Bus: BusView, Loop: LoopView },
};
const ENDED = 4001;

let strips, actuator, record, views, shown;

const stream = new Stream({
  onHello(hello) {
    Object.assign(hello, Object.values(hello.logs ?? {})[0]);
    document.title = `${hello.title} – hil-emulator`;
    byId("title").textContent = hello.title;
    strips = new Strips(hello, stream);
    if (hello.machine) actuator = new Actuator(byId("actuator"), hello);
    byId("actuator").hidden = !actuator;
    if (hello.logs) afterwards(hello);
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
    if (Object.keys(status).length) states(status);
    record?.show(status);
    views[shown].view.show(status, said);
  },
  onError: complain,
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

// What is over has a cursor in place of the present, and may have several logs.
function afterwards(hello) {
  let asking = false;
  strips.onTime = async (time) => {
    byId("clock").textContent = `${digits(time, 3)} s`;
    if (asking || !actuator) return;
    asking = true;
    const { row } = await stream.ask({ do: "row", time });
    actuator.show(row.map((value) => value ?? NaN));
    setTimeout(() => { asking = false; }, 30);
  };
  strips.onTime(hello.span[0]);
  const names = Object.keys(hello.logs);
  byId("states").append(names.length < 2 ? make("span", { class: "chip" }, hello.mode) : make("select", {
    "aria-label": "Log", id: "log",
    onchange: ({ target }) => {
      stream.tell({ do: "log", name: target.value });
      strips.turn({ ...hello, ...hello.logs[target.value] });
    },
  }, names.map((name) => make("option", {}, name))));
}

function tabs(hello) {
  const found = {};
  for (const [name, View] of Object.entries(TABS[hello.mode])) {
    const host = make("div", { hidden: true, role: "tabpanel", id: `panel-${name}`, "aria-labelledby": `tab-${name}` });
    const button = make("button", {
      type: "button", role: "tab", id: `tab-${name}`, "aria-controls": `panel-${name}`, "aria-selected": "false", onclick: () => open(name),
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

// Left and right go through the tabs, Home and End to the first and the last, as everywhere.
function step(name, key) {
  const names = Object.keys(views), at = names.indexOf(name);
  const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: -1 }[key];
  if (to === undefined) return;
  const next = names[(to + names.length) % names.length];
  open(next);
  views[next].button.focus();
}

function states({ nodes = [], faults = [], failures = [], timing, slipped, error }) {
  if (failures.length) byId("failures").textContent = failures.join("\n");
  byId("failures").hidden = !byId("failures").textContent;
  byId("states").replaceChildren(
    ...nodes.map(({ id, state }) => make("span", {
      class: `chip ${state === "operational" ? "good" : ""}`,
    }, `node ${id} ${state.replace("_", "-")}`)),
    faults.length ? make("span", { class: "chip bad" }, `${faults.length} fault${faults.length > 1 ? "s" : ""}`) : "");
  if (error) byId("health").textContent = error;
  else if (timing) byId("health").textContent = `${timing.late} late, ${digits(slipped ?? 0, 3)} s behind real time`;
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
