// Sliders send their values once they rest for a moment; answers come as lines of one response that stays open.
const REST = 40, by = id => document.getElementById(id), moved = new Map(), sliders = new Map();
const LOOKS = { full: ["last full run", "#8a94a3", "2 3"], spring: ["spring", "#D55E00", "6 4"], stopper: ["stopper", "#009E73", "none"], seat: ["seat", "#0072B2", "none"] };
let number = 0, timer = 0, last = null, full = null, longer = 1;

function post(place, request) {
  const headers = { "X-Seatfem-Token": TOKEN };
  if (request) headers["Content-Type"] = "application/json";
  return fetch(place, { method: "POST", headers, body: request && JSON.stringify(request) });
}

function say(words, style = "") { by("state").textContent = words; by("state").className = `state ${style}`; }

function send(request) {
  number += 1;
  post("/values", { ...request, number, values: Object.fromEntries(moved) }).catch(() => say("The server has ended.", "missed"));
}

function busy(is, share) {
  document.body.classList.toggle("busy", is);
  by("progress").hidden = !is;
  if (share === undefined) by("progress").removeAttribute("value"); else by("progress").value = share;
}

// Sliders: -100 to 100 is half to double, 0 to 100 a range from zero.

function valueAt(slider, place) {
  const value = slider.number ? slider.number * 2 ** (place / 100) : slider.most * place / 100;
  return place === 0 ? slider.number : Number(value.toPrecision(4));
}

function put(slider, value) {  // shows a value, wherever it came from
  if (value === slider.number) moved.delete(slider.key); else moved.set(slider.key, value);
  slider.label.classList.toggle("moved", value !== slider.number);
  slider.output.textContent = `${Number(value.toPrecision(4))} ${slider.unit}`;
}

function show(slider) {
  slider.label = document.createElement("label");
  slider.output = document.createElement("output");
  slider.input = document.createElement("input");
  Object.assign(slider.input, { type: "range", min: slider.number ? -100 : 0, max: 100, step: 1, value: 0, name: slider.key });
  slider.label.append(slider.words, slider.output, slider.input);
  slider.label.title = `${slider.key}: ${slider.least} to ${slider.most} ${slider.unit}`;
  slider.input.addEventListener("input", () => {
    put(slider, valueAt(slider, Number(slider.input.value)));
    clearTimeout(timer);
    timer = setTimeout(() => send({}), REST);
  });
  by(slider.is_quick ? "quick" : "slow").append(slider.label);
  put(slider, slider.number);
}

function setAll(values) {
  for (const slider of sliders.values()) {
    const value = values[slider.key] ?? slider.number;
    slider.input.value = slider.number ? Math.round(100 * Math.log2(value / slider.number)) : 100 * value / slider.most;
    put(slider, value);
  }
}

// What is shown

function drawAll() {
  if (!last) return;
  for (const [id, unit] of [["force", "N"], ["lift", "m"]]) {
    const curves = { ...(full && full !== last ? { full: full[id].seat } : {}), ...last[id] };
    const shown = Object.keys(LOOKS).filter(name => curves[name]);
    draw(by(id).querySelector("svg"), shown.map(name => ({ ...curves[name], name: LOOKS[name][0], colour: LOOKS[name][1], dash: LOOKS[name][2] })), unit);
  }
  by("force").querySelector("small").textContent = last.landed ? "hardest landing" : "no landing";
}

function cell(row, words, style) { const made = row.insertCell(); made.textContent = words; made.className = style || ""; return made; }

function fill(rows) {
  by("rows").replaceChildren();
  for (const each of rows) {
    const row = by("rows").insertRow();
    if (each.heading !== undefined) { row.className = "section heading"; cell(row, each.heading).colSpan = 4; continue; }
    cell(row, each.words);
    for (const name of ["value", "spring", "full"]) cell(row, each[name], "number");
  }
}

function present(answer) {
  busy(false);
  by("fields").disabled = false; by("stop").hidden = true;
  if (number === 0) setAll(answer.values || {});  // of a page that was loaded again
  fill(answer.rows);
  last = answer.curves;
  by("verdict").textContent = answer.standing || "\u00a0";
  drawAll();
}

const TAKE = {
  sliders(message) {
    by("title").textContent = message.title; document.title = `${message.title} - seatfem live`;
    for (const slider of message.sliders) { sliders.set(slider.key, slider); show(slider); }
    by("more").hidden = !by("slow").children.length;
  },
  running(message) {
    by("fields").disabled = true; by("stop").hidden = Boolean(message.first);
    busy(true); say("computing in full");
  },
  round(message) { say(message.words); },
  computing() { busy(true); say("computing"); },
  progress(message) {
    if (!document.body.classList.contains("busy")) return;
    busy(true, message.done); by("progress").title = message.stage;
  },
  answer(message) {
    if (message.number < number) return;
    present(message);
    say(`answered in ${message.seconds.toFixed(2)} s${message.is_quick ? "" : ", with bodies computed again"}`);
    by("bars").textContent = !message.is_alike ? "\u00b1 is not known: these values need another method than the last full run, here a coarse one."
      : "\u00b1 is not measured for these values: it is the uncertainty of the last full run, in proportion to the value"
        + (longer > 1 ? `, and what a time step ${longer.toFixed(0)} times as long changes in that run.` : ".");
  },
  full(message) {
    full = message.curves; longer = message.longer;
    present(message);
    const aim = `accuracy of ${Number((100 * message.target).toPrecision(3))} %`;
    if (message.met === null) say("computed in full: no landing to judge", "missed");
    else say(`computed in full: ${aim} ${message.met ? "reached" : "missed"} (${message.judged})`, message.met ? "met" : "missed");
    by("bars").textContent = "\u00b1 is the uncertainty that this run has measured.";
    by("written").hidden = !message.written.length;
    by("written").textContent = `Written: ${message.written.join(", ")}. seatfem view ${(message.written[1] || "").replace("/", "")} shows the run.`;
  },
  failed(message) { busy(false); by("fields").disabled = !sliders.size; by("stop").hidden = true; say(message.words, "missed"); },
  ended(message) { busy(false); by("fields").disabled = true; say(message.words, "missed"); },
  superseded() {},
};

async function listen() {
  const response = await post("/answers");
  if (!response.ok) { say(await response.text(), "missed"); return; }
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  for (let rest = "", ended = false; !ended;) {
    const { value, done } = await reader.read();
    const lines = (rest + (value || "")).split("\n");
    ended = done; rest = lines.pop();
    for (const line of lines) if (line) { const message = JSON.parse(line); TAKE[message.kind](message); }
  }
  TAKE.ended({ words: "seatfem live has ended." });
}

by("controls").addEventListener("submit", event => event.preventDefault());
by("full").addEventListener("click", () => send({ full: true }));
by("stop").addEventListener("click", () => send({}));
by("back").addEventListener("click", () => { setAll({}); send({}); });
new ResizeObserver(drawAll).observe(by("force"));
listen().catch(() => TAKE.ended({ words: "seatfem live has ended." }));
