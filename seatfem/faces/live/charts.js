// Curves over time as SVG: axes with round numbers, and a legend.
"use strict";
const PREFIXES = [[1, ""], [1e-3, "m"], [1e-6, "u"], [1e-9, "n"]];

function element(parent, name, attributes, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return parent.appendChild(made);
}

function marks(low, high, unit, count) {  // round numbers from low to high: where they are, and their text; and the unit
  const [size, prefix] = PREFIXES.find(([each]) => Math.max(high - low, 1e-99) >= each) || [1, ""];
  const raw = (high - low) / size / count || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find(each => each * power >= raw * 0.999), list = [];
  const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  for (let k = Math.ceil(low / size / step - 1e-9); k * step * size <= high * (1 + 1e-9); k++) list.push([k * step * size, (k * step).toFixed(places)]);
  return [list, `[${prefix}${unit}]`];
}

function draw(svg, curves, unit, along) {  // curves: name, colour, dash, time [s], value [SI], the last one on top
  const { width, height } = svg.getBoundingClientRect(), left = 52, right = width - 10, top = 24, bottom = height - 36;
  svg.replaceChildren();
  if (!curves.length || width < 120) return;
  const all = key => curves.flatMap(curve => curve[key]);
  const from = Math.min(...all("time")), to = Math.max(...all("time")), low = Math.min(0, ...all("value"));
  const high = Math.max(...all("value"), low + 1e-12) * 1.04, [values, name] = marks(low, high, unit, 5);
  const [times, seconds] = marks(from, to, "s", Math.max(2, width / 100));
  const x = time => left + (time - from) / (to - from) * (right - left), y = value => bottom - (value - low) / (high - low) * (bottom - top);
  for (const [value, text] of values) {
    element(svg, "line", { class: "grid", x1: left, x2: right, y1: y(value), y2: y(value) });
    element(svg, "text", { x: left - 6, y: y(value) + 4, "text-anchor": "end" }, text);
  }
  for (const [time, text] of times) {
    element(svg, "line", { class: "axis", x1: x(time), x2: x(time), y1: bottom, y2: bottom + 4 });
    element(svg, "text", { x: x(time), y: bottom + 17, "text-anchor": "middle" }, text);
  }
  element(svg, "line", { class: "axis", x1: left, x2: right, y1: bottom, y2: bottom });
  element(svg, "text", { x: right, y: height - 4, "text-anchor": "end" }, `${along} ${seconds}`);
  element(svg, "text", { x: 2, y: 12 }, name);
  let at = left;
  for (const { name, colour, dash, time, value } of curves) {
    const points = time.map((each, k) => `${x(each).toFixed(1)},${y(value[k]).toFixed(1)}`), line = { stroke: colour, "stroke-dasharray": dash };
    element(svg, "path", { d: `M${points.join("L")}`, "data-curve": name, ...line });
    element(svg, "line", { x1: at, x2: at + 18, y1: 8, y2: 8, "stroke-width": 2, ...line });
    at += 28 + element(svg, "text", { x: at + 22, y: 12 }, name).getComputedTextLength();
  }
}
