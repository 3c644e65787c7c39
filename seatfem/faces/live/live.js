// Sliders send their values once they rest for a moment; answers come as lines of one response that stays open.
const REST = 40, by = id => document.getElementById(id), moved = new Map(), sliders = new Map();
const LOOKS = [["full", "last full run", "#8a94a3", "2 3"], ["spring", "spring", "#D55E00", "6 4"], ["seat", "seat", "#0072B2", "none"]];
let number = 0, timer = 0, last = null, full = null, longer = 1;

function post(place, request) {
  const headers = { "X-Seatfem-Token": TOKEN, ...(request && { "Content-Type": "application/json" }) };
  return fetch(place, { method: "POST", headers, body: request && JSON.stringify(request) });
}

function send(request) {
  number += 1;
  post("/values", { ...request, number, values: Object.fromEntries(moved) }).catch(() => TAKE.ended());
}

function say(words, style = "", share = null) {  // share: of work that goes on; null: none does
  by("state").textContent = words; by("state").className = `state ${style}`;
  document.body.classList.toggle("busy", share !== null);
  by("progress").hidden = share === null;
  if (share) by("progress").value = share; else by("progress").removeAttribute("value");
}

// -100 to 100 of a slider is half to double; of one whose value is zero, 0 to 100 is its range.
function valueAt({ number, most }, place) {
  return place === 0 ? number : Number((number ? number * 2 ** (place / 100) : most * place / 100).toPrecision(4));
}

function put(slider, value) {
  if (value === slider.number) moved.delete(slider.key); else moved.set(slider.key, value);
  slider.label.classList.toggle("moved", value !== slider.number);
  slider.output.textContent = `${value} ${slider.unit}`;
}

function setAll(values) {
  for (const slider of sliders.values()) {
    const value = values[slider.key] ?? slider.number;
    slider.input.value = slider.number ? 100 * Math.log2(value / slider.number) : 100 * value / slider.most;
    put(slider, value);
  }
}

function add(slider) {
  for (const [name, tag] of [["label", "label"], ["output", "output"], ["input", "input"]]) slider[name] = document.createElement(tag);
  Object.assign(slider.input, { type: "range", min: slider.number ? -100 : 0, max: 100, name: slider.key, value: 0 });
  slider.label.append(slider.words, slider.output, slider.input);
  slider.label.title = `${slider.key}: ${slider.least} to ${slider.most} ${slider.unit}`;
  slider.input.addEventListener("input", () => {
    put(slider, valueAt(slider, Number(slider.input.value)));
    clearTimeout(timer);
    timer = setTimeout(() => send({}), REST);
  });
  by(slider.is_quick ? "quick" : "slow").append(slider.label);
  sliders.set(slider.key, slider);
  put(slider, slider.number);
}

function drawAll() {
  for (const [id, unit] of last ? [["force", "N"], ["lift", "m"]] : []) {
    const curves = { full: full === last || full.landed !== last.landed ? undefined : full[id].seat, ...last[id] };
    const looks = LOOKS.filter(([key]) => curves[key]).map(([key, name, colour, dash]) => ({ ...curves[key], name, colour, dash }));
    draw(by(id).querySelector("svg"), looks, unit, id === "force" && last.landed ? "time after touch" : "time");
  }
}

function present(answer, words) {
  if (!number) setAll(answer.values);  // of a page that was loaded again
  by("rows").replaceChildren();
  for (const each of answer.rows) {
    const row = by("rows").insertRow(), names = ["words", "value", "spring", "full"].filter(name => name in each);
    if (names.length === 1) row.className = "section heading";
    for (const name of names) Object.assign(row.insertCell(), { textContent: each[name], className: name === "words" ? "" : "number" });
    if (names.length === 1) row.cells[0].colSpan = 4;
  }
  last = answer.curves;
  by("force").querySelector("small").textContent = last.landed ? "hardest landing" : "no landing";
  by("verdict").textContent = `${answer.standing} ${words}`;
  drawAll();
}

const TAKE = {
  sliders(message) {
    by("title").textContent = document.title = message.title;
    message.sliders.forEach(add);
    by("controls").hidden = false; by("more").hidden = !by("slow").children.length;
  },
  running() { say(`computing in full${sliders.size ? ": a slider that is moved stops it" : ""}`, "", 0); },
  round(message) { say(`computing in full: ${message.words}`, "", 0); },
  computing() { say("computing", "", 0); },
  progress(message) { if (document.body.classList.contains("busy")) say(by("state").textContent, "", message.done); },
  answer(message) {
    if (message.number < number) return;
    const step = longer > 1 ? `, and what a time step ${Math.round(longer)} times as long changes there` : "";
    present(message, message.is_alike
      ? `\u00b1: not measured here, but the last full run's uncertainty in proportion to the values${step}.`
      : "\u00b1: not known, as these values need another method than the last full run: this is a coarse first answer.");
    say(`answered by one march${message.is_quick ? "" : ", with bodies computed again"}`);
  },
  full(message) {
    full = message.curves; longer = message.longer;
    present(message, "");
    say(`computed in full: ${message.state}`, message.met ? "met" : "missed");
    by("written").textContent = message.written;
  },
  failed(message) { say(message.words, "missed"); },
  ended(message) {
    if (!by("controls").inert) say(message?.words || "seatfem live has ended", "missed");
    by("controls").inert = true;
  },
  superseded() {},
};

async function listen() {
  const response = await post("/answers");
  if (!response.ok) { say(await response.text(), "missed"); return; }
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  for (let rest = "", ended = false; !ended;) {
    const { value, done } = await reader.read(), lines = (rest + (value || "")).split("\n");
    ended = done; rest = lines.pop();
    for (const message of lines.map(JSON.parse)) TAKE[message.kind](message);
  }
  TAKE.ended();
}

by("full").addEventListener("click", () => send({ full: true }));
by("back").addEventListener("click", () => { setAll({}); send({}); });
new ResizeObserver(drawAll).observe(by("force"));
listen().catch(() => TAKE.ended());
