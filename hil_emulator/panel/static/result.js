// What an identification says: its verdict and reason, the effects it names, the gap by channel.

import { make, plain } from "./dom.js";

export class Result {
  constructor(host, { result }) {
    const { verdict, reason, effects, gap, measure } = result;
    host.append(make("h2", {}, `Verdict: ${verdict.replaceAll("_", " ")}`), make("p", {}, reason));
    if (effects.length) host.append(make("ul", { class: "list" }, effects.map(({ name }) => make("li", {}, make("strong", {}, name)))));
    const titles = ["channel", "data", "before", "after"];
    const rows = Object.entries(gap).flatMap(([channel, kinds]) => Object.entries(kinds).map(([kind, values], i) =>
      [i ? "" : channel, kind.replaceAll("_", " "), plain(values.before), plain(values.after)]));
    host.append(
      make("h3", {}, `Root mean square of measured less predicted, in ${measure}`),
      make("table", {}, make("thead", {}, make("tr", {}, titles.map((title, i) => make("th", { class: i > 1 ? "number" : "" }, title)))),
        make("tbody", {}, rows.map((cells) => make("tr", {}, cells.map((text, i) => make("td", { class: i > 1 ? "number" : "" }, text)))))),
      make("p", { class: "note" }, "On the strips: what was measured, the model with what was found, and, dashed, the " +
        "configured model. Free runs restart every 0.5 s from filtered states."));
  }

  show() {}
}
