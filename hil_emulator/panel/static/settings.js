// Set points and surroundings: sliders over what the machine bears, numbers within their bounds.

import { make, plain } from "./dom.js";

const PAUSE_MS = 60;

export class Settings {
  constructor(host, hello, stream) {
    this.stream = stream;
    this.lines = hello.settings.map((setting) => this.line(setting));
    host.append(
      ...this.lines.map(({ element }) => element),
      make("p", { class: "note" }, "valve_current is written into the node, as an SDO client does: it " +
        "is in force while the node is OPERATIONAL, until the next RPDO."));
  }

  line(setting) {
    const { name, meaning, unit, scale, low, high } = setting;
    const [from, to] = setting.slider.map((value) => value / scale);
    const line = { setting, touched: 0 };
    line.slider = make("input", {
      type: "range", min: from, max: to, step: (to - from) / 400, "aria-label": `${name}, slider`,
      oninput: () => { line.number.value = plain(Number(line.slider.value)); this.change(line); },
    });
    line.number = make("input", {
      type: "number", step: "any", "aria-label": name, name,
      onchange: () => { line.slider.value = line.number.value; this.change(line); },
      oninput: () => { line.touched = performance.now(); },
    });
    line.zero = from < 0 ? make("button", {
      type: "button", title: "Set to 0", onclick: () => { line.number.value = line.slider.value = 0; this.change(line); },
    }, "0") : null;
    line.trouble = make("p", { class: "bad", role: "alert" });
    line.element = make("div", { class: "setting", "data-setting": name },
      make("div", {}, make("strong", {}, name), " ", make("span", { class: "note" }, meaning)),
      make("div", { class: "row" }, line.slider, line.number, unit, line.zero),
      make("span", { class: "note" }, `${plain(low / scale)} … ${plain(high / scale)} ${unit}`.replaceAll("-", "−")), line.trouble);
    return line;
  }

  // Sends the last value of a motion of the slider, not each one on the way.
  change(line) {
    line.touched = performance.now();
    clearTimeout(line.timer);
    line.timer = setTimeout(async () => {
      const { name, unit } = line.setting;
      try {
        const text = line.number.value.trim();
        await this.stream.ask({ do: "set", [name]: unit ? `${text} ${unit}` : Number(text) });
        line.trouble.textContent = "";
      } catch (error) {
        line.trouble.textContent = error.message;
      }
    }, PAUSE_MS);
  }

  show({ settings = {} }) {
    for (const line of this.lines) {
      const value = settings[line.setting.name];
      const absent = value == null;
      line.slider.disabled = line.number.disabled = absent;
      line.trouble.className = absent ? "note" : "bad";
      if (absent) line.trouble.textContent = "The machine has nothing that this acts on.";
      const touched = performance.now() - line.touched < 2000 || document.activeElement === line.number;
      if (absent || touched || line.trouble.textContent) continue;
      const shown = value / line.setting.scale;
      line.slider.value = shown;
      line.number.value = Number(shown.toPrecision(6));
    }
  }
}
