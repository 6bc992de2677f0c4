// Elements in one line, and numbers as an instrument writes them.

export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value != null) element.setAttribute(name, value);
  }
  element.append(...children.flat().filter((child) => child != null));
  return element;
}

export const byId = (id) => document.getElementById(id);

// Four digits that count, as many places as the range needs, no leap between two readings.
export function digits(value, places) {
  if (value == null || Number.isNaN(value)) return "–";
  return value.toFixed(places).replace("-", "−");
}

export function placesFor(span) {
  if (!(span > 0)) return 2;
  return Math.min(6, Math.max(0, 2 - Math.floor(Math.log10(span))));
}

export function plain(value) {
  if (value == null) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e8)) return value.toExponential(3);
  return String(Number(value.toPrecision(5)));
}

// Returns how long a message is overdue, in words; "" while it comes, or if it is no periodic one.
export function overdue({ age, period }) {
  if (age == null || !period || age < Math.max(1, 5 * period)) return "";
  return `silent for ${age < 100 ? digits(age, 1) : Math.round(age)} s`;
}

export function save(name, blob) {
  const link = make("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
