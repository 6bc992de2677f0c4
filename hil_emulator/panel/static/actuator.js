// The actuator to scale and moving: cylinder, load, spool, pressures as colour.

import { colour, digits } from "./dom.js";

const SVG = "http://www.w3.org/2000/svg";
const WIDE = 400, LEFT = 46, ROOM = 190, MOST_BORE = 90, TOP = 34;

function draw(tag, attributes, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

export class Actuator {
  constructor(host, hello) {
    const { stroke, piston_area: area, area_ratio: ratio, mass } = hello.machine;
    this.machine = hello.machine;
    this.index = Object.fromEntries(hello.columns.map(({ name }, i) => [name, i]));
    const bore = 2 * Math.sqrt(area / Math.PI), rod = bore * Math.sqrt(Math.max(0.04, 1 - ratio));
    this.scale = Math.min(ROOM / stroke, MOST_BORE / bore);
    this.length = stroke * this.scale;
    this.bore = Math.max(18, bore * this.scale);
    this.rod = Math.max(4, rod * this.scale);
    this.piston = 8;
    this.middle = TOP + this.bore / 2;
    this.valveTop = TOP + this.bore + 46;
    this.svg = draw("svg", { viewBox: `0 0 ${WIDE} ${this.valveTop + 92}`, role: "img", "aria-label": "actuator" });
    this.cylinder(mass);
    this.valve();
    host.append(this.svg);
  }

  put(tag, attributes, ...children) {
    const element = draw(tag, attributes, ...children);
    this.svg.append(element);
    return element;
  }

  text(x, y, text = "", anchor = "start", kind = "") {
    return this.put("text", { x, y, "text-anchor": anchor, class: kind }, text);
  }

  cylinder(mass) {
    const right = LEFT + this.length + this.piston;
    const line = { stroke: "var(--ink)", "stroke-width": 1.5, fill: "none" };
    this.chamberA = this.put("rect", { x: LEFT, y: TOP, height: this.bore, width: 0 });
    this.chamberB = this.put("rect", { x: LEFT, y: TOP, height: this.bore, width: 0 });
    this.put("rect", { x: LEFT, y: TOP, width: right - LEFT, height: this.bore, ...line });
    this.stem = this.put("rect", { y: this.middle - this.rod / 2, height: this.rod, fill: "var(--card)", stroke: "var(--ink)", "stroke-width": 1.2 });
    this.head = this.put("rect", { y: TOP, width: this.piston, height: this.bore, fill: "var(--ink)" });
    this.loadBlock = this.put("rect", { y: this.middle - 20, width: 44, height: 40, rx: 3, fill: "var(--line)", stroke: "var(--ink)" });
    this.loadText = this.text(0, this.middle + 4, mass >= 1000 ? `${mass / 1000} t` : `${+mass.toPrecision(3)} kg`, "middle");
    this.arrow = this.put("path", { fill: "var(--s2)", stroke: "none" });
    this.textA = this.text(LEFT, TOP - 8);
    this.textB = this.text(right, TOP - 8, "", "end");
    this.textX = this.text(LEFT + 14, TOP + this.bore + 15);
    this.textF = this.text(WIDE - 6, TOP + this.bore + 15, "", "end");
    this.put("path", { d: `M${LEFT - 8} ${TOP - 4}V${TOP + this.bore + 4}`, stroke: "var(--ink)", "stroke-width": 3 });
    for (let i = 0; i <= this.bore + 8; i += 8) {
      this.put("path", { d: `M${LEFT - 8} ${TOP - 4 + i}l-6 6`, stroke: "var(--faint)" });
    }
  }

  // The three boxes of a 4/3 valve, which stand over the ports as far as the spool has moved.
  valve() {
    const y = this.valveTop, box = 36, x = LEFT + 70;
    const portA = x - 9, portB = x + 9;
    const right = LEFT + this.length + this.piston;
    this.lineA = this.put("path", { d: `M${portA} ${y}V${y - 14}H${LEFT + 6}V${TOP + this.bore}`, fill: "none", "stroke-width": 4 });
    this.lineB = this.put("path", { d: `M${portB} ${y}V${y - 22}H${right - 6}V${TOP + this.bore}`, fill: "none", "stroke-width": 4 });
    this.lineP = this.put("path", { d: `M${portA} ${y + box}v20`, fill: "none", "stroke-width": 4 });
    this.lineT = this.put("path", { d: `M${portB} ${y + box}v20`, fill: "none", "stroke-width": 4 });
    this.text(portA - 8, y + box + 16, "P", "end", "faint");
    this.text(portB + 8, y + box + 16, "T", "start", "faint");
    this.boxes = this.put("g", {});
    const frame = { y, width: box, height: box, fill: "var(--card)", stroke: "var(--ink)", "stroke-width": 1.2 };
    const paths = [
      [-1.5, `M-9 32V6m-4 5l4-6 4 6M9 5V31m-4-5l4 6 4-6`],
      [-0.5, `M-9 5v7m-4 0h8M9 5v7m-4 0h8M-9 32v-7m-4 0h8M9 32v-7m-4 0h8`],
      [0.5, `M-9 32L9 6m-6 2l6-3 1 7M9 32L-9 6m6 2l-6-3-1 7`],
    ];
    for (const [place, arrows] of paths) {
      this.boxes.append(draw("rect", { x: x + place * box, ...frame }));
      this.boxes.append(draw("path", { d: arrows, transform: `translate(${x + (place + 0.5) * box} ${y})`, stroke: "var(--ink)", "stroke-width": 1.3, fill: "none" }));
    }
    this.box = box;
    const left = LEFT + 170;
    this.textU = this.text(left, y + 6);
    this.textI = this.text(left, y + 23);
    this.textS = this.text(left, y + 40);
    this.textQ = this.text(left, y + 57);
  }

  // Shows the present values, as they stand in a live message.
  show(present) {
    const value = (name) => present[this.index[name]];
    const x = value("model.position"), a = value("model.pressure_a"), b = value("model.pressure_b");
    const supply = value("model.supply_pressure"), tank = value("model.tank_pressure");
    const force = value("model.load_force"), spool = value("model.spool_position");
    if (!Number.isFinite(x)) return;
    const at = LEFT + Math.min(Math.max(x, -0.05 * this.machine.stroke), 1.05 * this.machine.stroke) * this.scale;
    const right = LEFT + this.length + this.piston, end = Math.min(at + this.length + 26, WIDE - 60);
    this.chamberA.setAttribute("width", Math.max(0, at - LEFT));
    this.chamberB.setAttribute("x", at + this.piston);
    this.chamberB.setAttribute("width", Math.max(0, right - at - this.piston));
    this.head.setAttribute("x", at);
    this.stem.setAttribute("x", at + this.piston);
    this.stem.setAttribute("width", Math.max(0, end - at - this.piston));
    this.loadBlock.setAttribute("x", end);
    this.loadText.setAttribute("x", end + 22);
    this.fill(a, b, supply, tank);
    this.pull(force, end + 22);
    const share = Math.max(-1, Math.min(1, spool / this.machine.current));
    this.boxes.setAttribute("transform", `translate(${(share * this.box).toFixed(1)} 0)`);
    this.textA.textContent = `a ${digits(a / 1e5, 1)} bar`;
    this.textB.textContent = `b ${digits(b / 1e5, 1)} bar`;
    this.textX.textContent = `x ${digits(x * 1e3, 2)} mm`;
    this.textF.textContent = `F ${digits(force, 0)} N`;
    this.textU.textContent = `spool ${digits(spool * 1e3, 2)} mA (${digits(share * 100, 0)} %)`;
    this.textI.textContent = `set point ${digits(value("valve_current") * 1e3, 2)} mA`;
    this.textS.textContent = `supply ${digits(supply / 1e5, 1)} bar`;
    this.textQ.textContent = `flow ${digits(value("model.supply_flow") * 6e4, 2)} l/min`;
  }

  fill(a, b, supply, tank) {
    const tint = (pressure) => {
      const share = Math.max(0, Math.min(1, pressure / this.machine.supply_pressure));
      return `color-mix(in srgb, var(--high) ${Math.round(100 * share)}%, var(--low))`;
    };
    this.chamberA.style.fill = this.lineA.style.stroke = tint(a);
    this.chamberB.style.fill = this.lineB.style.stroke = tint(b);
    this.lineP.style.stroke = tint(supply);
    this.lineT.style.stroke = tint(tank);
  }

  // An arrow of the force on the load, as long as the supply's force on the piston is a full one.
  pull(force, x) {
    const long = Math.max(-1, Math.min(1, force / this.machine.force)) * 56, y = this.middle + 30;
    const tip = Math.sign(long) * Math.min(8, Math.abs(long));
    this.arrow.setAttribute("d", Math.abs(long) < 1 ? "" :
      `M${x} ${y - 2}h${long - tip}v-4l${tip} 6 ${-tip} 6v-4h${tip - long}z`);
  }
}
