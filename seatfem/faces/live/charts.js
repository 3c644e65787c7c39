// Curves over time as SVG: axes with round numbers, a legend, nothing else.
"use strict";
const SVG = "http://www.w3.org/2000/svg", PREFIXES = [[1, ""], [1e-3, "m"], [1e-6, "u"], [1e-9, "n"]];

function element(parent, name, attributes, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return parent.appendChild(made);
}

function prefixed(largest, unit) {  // divisor and unit in which the largest value is easily read
  const [size, prefix] = PREFIXES.find(([each]) => largest >= each) || [1, ""];
  return [size, prefix + unit];
}

function roundSteps(low, high, count) {  // round numbers from low to high
  const raw = (high - low) / count || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find(each => each * power >= raw * 0.999), steps = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) steps.push(k * step);
  return [steps, Math.max(0, -Math.floor(Math.log10(step) + 1e-9))];
}

function draw(svg, curves, unit) {  // curves: name, colour, time [s], value [SI], the last one on top
  const box = svg.getBoundingClientRect(), left = 52, right = 10, top = 24, bottom = 36;
  svg.replaceChildren();
  if (!curves.length || box.width < 120) return;
  const all = key => curves.flatMap(curve => curve[key]), ends = values => [Math.min(...values), Math.max(...values)];
  const [from, to] = ends(all("time")), [least, most] = ends(all("value"));
  const [second, seconds] = prefixed(to - from, "s"), [size, name] = prefixed(Math.max(-least, most), unit);
  const low = Math.min(least, 0), high = most > low ? most + 0.04 * (most - low) : low + size;
  const x = time => left + (time - from) / (to - from || 1) * (box.width - left - right);
  const y = value => box.height - bottom - (value - low) / (high - low) * (box.height - top - bottom);
  const [times, timePlaces] = roundSteps(from / second, to / second, Math.max(2, box.width / 110));
  const [values, places] = roundSteps(low / size, high / size, 5);
  for (const value of values) {
    element(svg, "line", { class: "grid", x1: left, x2: box.width - right, y1: y(size * value), y2: y(size * value) });
    element(svg, "text", { x: left - 6, y: y(size * value) + 4, "text-anchor": "end" }, value.toFixed(places));
  }
  for (const time of times) {
    element(svg, "line", { class: "axis", x1: x(second * time), x2: x(second * time), y1: box.height - bottom, y2: box.height - bottom + 4 });
    element(svg, "text", { x: x(second * time), y: box.height - bottom + 17, "text-anchor": "middle" }, time.toFixed(timePlaces));
  }
  element(svg, "line", { class: "axis", x1: left, x2: box.width - right, y1: box.height - bottom, y2: box.height - bottom });
  element(svg, "text", { x: box.width - right, y: box.height - 4, "text-anchor": "end" }, `time [${seconds}]`);
  element(svg, "text", { x: 2, y: 12 }, `[${name}]`);
  let at = left;
  for (const curve of curves) {
    const points = curve.time.map((time, k) => `${x(time).toFixed(1)},${y(curve.value[k]).toFixed(1)}`);
    element(svg, "path", { d: `M${points.join("L")}`, stroke: curve.colour, "stroke-dasharray": curve.dash, "data-curve": curve.name });
    element(svg, "line", { x1: at, x2: at + 18, y1: 8, y2: 8, stroke: curve.colour, "stroke-width": 2, "stroke-dasharray": curve.dash });
    at += 28 + element(svg, "text", { x: at + 22, y: 12 }, curve.name).getComputedTextLength();
  }
}
