// Recording on and off, with markers.

import { byId, make } from "./dom.js";

export class Record {
  constructor(hello, stream, complain) {
    this.stream = stream;
    this.complain = complain;
    this.button = make("button", { type: "button", id: "record", onclick: () => this.toggle() }, "Record");
    this.state = make("span", { class: "chip", hidden: true });
    this.marker = make("button", { type: "button", id: "marker", title: "Put a word at this moment", onclick: () => this.mark() }, "Marker");
    byId("recording").append(this.state, this.button, this.marker);
    this.title = hello.title;
  }

  toggle() {
    const stamp = new Date().toISOString().slice(0, 19).replaceAll(":", "").replace("T", "_");
    this.attempt({ do: "record", file: `${this.title.replace(/[^\w-]+/g, "_")}_${stamp}.rec` });
  }

  mark() {
    const text = prompt("Marker", "marker");
    if (text) this.attempt({ do: "marker", text });
  }

  async attempt(request) {
    try {
      await this.stream.ask(request);
    } catch (error) {
      this.complain(error.message);
    }
  }

  show({ recording }) {
    this.button.textContent = recording ? "Stop" : "Record";
    this.state.hidden = !recording;
    this.state.className = "chip bad";
    this.state.textContent = `● ${recording}`;
  }
}
