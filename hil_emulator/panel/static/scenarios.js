// Scenarios: played on an emulator of their own, their expectations turning green.

import { digits, make } from "./dom.js";

const WORDS = { open: "open", met: "met", missed: "missed" };

export class Scenarios {
  constructor(host, hello, stream) {
    this.stream = stream;
    this.choice = make("select", { "aria-label": "Scenario", id: "scenario" }, hello.scenarios.map((name) => make("option", {}, name)));
    this.title = make("h3");
    this.bar = make("progress", { max: 1, value: 0, style: "width:100%", hidden: true });
    this.list = make("ul", { class: "list", id: "expectations" });
    this.trouble = make("p", { class: "bad", role: "alert" });
    host.append(
      make("form", { class: "row", onsubmit: (event) => { event.preventDefault(); this.go(this.choice.value); } },
        this.choice, make("button", { type: "submit", class: "main" }, "Play"),
        make("button", { type: "button", onclick: () => this.go() }, "Stop")),
      make("p", { class: "note" }, "Played with a controller of its own on an emulator of its own; the live bench goes on."),
      this.title, this.bar, this.list, this.trouble);
  }

  async go(name) {
    this.trouble.textContent = "";
    try {
      await this.stream.ask(name ? { do: "play", name } : { do: "play" });
    } catch (error) {
      this.trouble.textContent = error.message;
    }
  }

  show({ scenario }) {
    if (!scenario) return;
    if (scenario.trouble) {
      this.trouble.textContent = scenario.trouble;
      return;
    }
    const { title, time, duration, checks } = scenario;
    this.title.textContent = duration ? `${title}: ${digits(time, 1)} of ${duration} s` : `${title}: starts`;
    this.bar.hidden = false;
    this.bar.value = duration ? time / duration : 0;
    this.list.replaceChildren(...checks.map(({ text, found, state }) => make("li", {},
      make("span", {}, text, make("span", { class: "note", style: "display:block" }, found)),
      make("span", { class: `chip ${{ met: "good", missed: "bad" }[state] ?? ""}` }, WORDS[state]))));
  }
}
