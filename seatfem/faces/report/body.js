// Shows the bodies of a report and hears their controls: WebGL 2, no library.
"use strict";
class Body {
  constructor(figure) {
    this.figure = figure;
    this.canvas = figure.querySelector("canvas");
    this.of = {};
    for (const each of figure.querySelectorAll("[data-of]")) this.of[each.dataset.of] = each;
    const data = this.data = JSON.parse(figure.querySelector("script").textContent);
    this.points = decoded(data.points, Float32Array);
    this.triangles = decoded(data.triangles, Uint32Array);
    this.steps = decoded(data.displacement, Int16Array);
    this.values = data.values && decoded(data.values, Uint16Array);
    this.count = this.points.length / 3;
    this.ends = [0, 1, 2].map(axis => {  // of the body at rest along each axis
      let low = Infinity, high = -Infinity;
      for (let k = axis; k < this.points.length; k += 3) { low = Math.min(low, this.points[k]); high = Math.max(high, this.points[k]); }
      return [low, high];
    });
    this.side = 1;  // of a section that is taken away: that of the greater or of the lesser numbers
    this.view = { ...HOME };
    this.frame = data.first; this.phase = 1; this.playing = false;
    this.reach = this.turned().slice(0, 2).map(axis => {  // half of what is seen to the side and upwards, at least
      let most = 0;
      for (let k = 0; k < this.points.length; k += 3)
        most = Math.max(most, Math.abs(axis[0] * this.points[k] + axis[1] * this.points[k + 1] + axis[2] * this.points[k + 2]));
      return 1.15 * most;
    });
    this.gl = this.canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!this.gl) {
      for (const each of figure.querySelectorAll("button, input, select")) each.disabled = true;
      return;
    }
    this.prepare();
    this.listen();
    this.of.probe.textContent = "Click on the body for the values there.";
    document.documentElement.classList.add("drawn");
    figure.dataset.ready = "yes";  // the stage is there from now on
    this.show(this.frame);
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  prepare() {
    const gl = this.gl, program = this.program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(program, shader);
    }
    ["rest", "moved", "value"].forEach((name, k) => gl.bindAttribLocation(program, k, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    const kept = (kind, values) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(kind, buffer); gl.bufferData(kind, values, gl.STATIC_DRAW);
      return buffer;
    };
    kept(gl.ARRAY_BUFFER, this.points);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    this.moves = kept(gl.ARRAY_BUFFER, this.steps);
    this.tints = this.values && kept(gl.ARRAY_BUFFER, this.values);
    this.faces = kept(gl.ELEMENT_ARRAY_BUFFER, this.triangles);
    const edges = sharpEdges(this.points, this.triangles);
    this.edges = kept(gl.ELEMENT_ARRAY_BUFFER, edges); this.edgeCount = edges.length;
    this.at = name => gl.getUniformLocation(program, name);
    gl.uniform3fv(this.at("colours"), VIRIDIS.flatMap(hex => [0, 2, 4].map(k => parseInt(hex.slice(k, k + 2), 16) / 255)));
    gl.uniform3fv(this.at("grey"), GREY); gl.uniform3fv(this.at("inside"), INSIDE); gl.uniform1i(this.at("closed"), this.data.closed);
    gl.enable(gl.DEPTH_TEST); gl.clearColor(1, 1, 1, 1);
    this.canvas.addEventListener("webglcontextlost", () => { this.of.probe.textContent = "The drawing was lost; reload the page."; });
  }

  get coloured() { return Boolean(this.values) && this.of.colour.value === "1"; }

  get section() {  // normal and place of the plane beyond which nothing is drawn, in the body at rest
    if (this.of.axis.value === "") return UNCUT;
    const axis = Number(this.of.axis.value), [low, high] = this.ends[axis], share = Number(this.of.cut.value) / 1000;
    return [...[0, 1, 2].map(k => k === axis ? this.side : 0), this.side * (low + share * (high - low))];
  }

  get factor() {  // drawn over true displacements; of modes the largest drawn over the size of the body
    const share = Number(this.of.scale.value) / 100;
    if (this.data.modes) return 0.3 * share * share;
    const whole = Math.max(1, 0.1 * this.data.size / this.data.largest);  // in the middle; true at the left end
    return share < 0.5 ? Math.pow(whole, 2 * share) : whole * Math.pow(4, 2 * share - 1);
  }

  turned() {  // columns of the matrix that turns the body to the camera: right, up, towards
    const { turn, lift } = this.view, [c, s, cl, sl] = [Math.cos(turn), Math.sin(turn), Math.cos(lift), Math.sin(lift)];
    const right = [-s, c, 0], up = [-c * sl, -s * sl, cl], towards = [c * cl, s * cl, sl];
    return [right, up, towards];
  }

  draw() {
    const gl = this.gl, canvas = this.canvas, data = this.data, view = this.view;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map(x => Math.max(1, Math.round(x * ratio)));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const axes = this.turned(), wide = width / height;
    const near = view.zoom * Math.min(1 / this.reach[1], wide / this.reach[0]);
    this.zoom = [near / wide, near, -0.3 / data.size];
    gl.uniformMatrix3fv(this.at("turn"), false, [0, 1, 2].flatMap(k => axes.map(axis => axis[k])));
    gl.uniform3fv(this.at("zoom"), this.zoom);
    gl.uniform3fv(this.at("shift"), [view.x, view.y, 0]);
    const largest = data.largest * 32767 / data.finest;  // of a normalised step
    this.pull = (data.modes ? this.factor * data.size : this.factor) * largest * (data.modes ? this.phase : 1);
    const pull = this.pull;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.moves);
    gl.enableVertexAttribArray(1); gl.vertexAttribPointer(1, 3, gl.SHORT, true, 6, 6 * this.count * this.frame);
    if (this.values) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.tints);
      gl.enableVertexAttribArray(2); gl.vertexAttribPointer(2, 1, gl.UNSIGNED_SHORT, true, 2, 2 * this.count * this.frame);
    }
    gl.uniform2fv(this.at("scale"), [65535 / (data.untold - 1), 1]);
    gl.uniform1i(this.at("coloured"), this.coloured);
    gl.uniform4fv(this.at("cut"), this.section);
    gl.uniform1i(this.at("line"), 0); gl.uniform1f(this.at("pull"), pull);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.faces);
    gl.drawElements(gl.TRIANGLES, this.triangles.length, gl.UNSIGNED_INT, 0);
    gl.uniform1i(this.at("line"), 1); gl.uniform1f(this.at("pull"), 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.edges);
    gl.drawElements(gl.LINES, this.edgeCount, gl.UNSIGNED_INT, 0);
  }

  label() {
    const data = this.data, short = x => Number(x.toPrecision(3)).toString();
    if (this.of.label) this.of.label.textContent = data.labels[this.frame];
    const of = this.of, own = this.coloured;
    of.low.textContent = own ? short(data.low) : "0";
    of.high.textContent = own ? short(data.high) : short(data.moved);
    of.unit.textContent = own ? `${data.quantity} [${data.unit}]` : data.modes ? "displacement, relative" : `displacement [${data.moved_unit}]`;
    of.factor.textContent = data.modes ? `${short(100 * this.factor)} % of the size` : `${short(this.factor)} times`;
    const axis = Number(of.axis.value), cut = this.section;
    of.cut.disabled = of.axis.value === "";
    of.place.textContent = of.cut.disabled ? "" : `${"xyz"[axis]} = ${(1e3 * (this.side * cut[3] + data.centre[axis])).toPrecision(4)} mm`;
    of.cut.setAttribute("aria-valuetext", of.place.textContent);
    if (of.frame.type === "range") of.frame.setAttribute("aria-valuetext", data.labels[this.frame]);
    of.scale.setAttribute("aria-valuetext", of.factor.textContent);
  }

  show(frame) {
    this.frame = (frame + this.data.labels.length) % this.data.labels.length;
    this.of.frame.value = String(this.frame);
    this.label(); this.draw();
  }

  play(on) {
    this.playing = on; this.phase = 1;
    this.of.play.textContent = on ? "pause" : "play";
    this.of.play.setAttribute("aria-pressed", String(on));
    const start = performance.now();
    let shown = start;
    const step = now => {
      if (!this.playing) { this.draw(); return; }
      if (this.data.modes) { this.phase = Math.cos((now - start) / 1500 * 2 * Math.PI); this.draw(); }
      else if (now - shown > 150) { shown = now; this.show(this.frame + 1); }
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  turn(right, up) {
    this.view.turn -= right; this.view.lift = Math.max(-1.57, Math.min(1.57, this.view.lift + up));
    this.draw();
  }

  zoomBy(factor) { this.view.zoom = Math.max(0.2, Math.min(60, this.view.zoom * factor)); this.draw(); }

  listen() {
    const of = this.of, canvas = this.canvas;
    of.frame.addEventListener("input", () => this.show(Number(of.frame.value)));
    of.scale.addEventListener("input", () => { this.label(); this.draw(); });
    of.axis.addEventListener("input", () => {
      if (of.axis.value !== "") this.side = this.turned()[2][Number(of.axis.value)] < 0 ? -1 : 1;  // the half towards the camera
      this.label(); this.draw();
    });
    of.cut.addEventListener("input", () => { this.label(); this.draw(); });
    if (of.colour) of.colour.addEventListener("input", () => { this.label(); this.draw(); });
    of.play.addEventListener("click", () => this.play(!this.playing));
    of.nearer.addEventListener("click", () => this.zoomBy(1.25));
    of.farther.addEventListener("click", () => this.zoomBy(0.8));
    of.reset.addEventListener("click", () => { this.view = { ...HOME }; this.draw(); });
    const keys = {
      ArrowLeft: () => this.turn(-0.1, 0), ArrowRight: () => this.turn(0.1, 0), ArrowUp: () => this.turn(0, -0.1),
      ArrowDown: () => this.turn(0, 0.1), "+": () => this.zoomBy(1.25), "=": () => this.zoomBy(1.25), "-": () => this.zoomBy(0.8),
      "0": () => of.reset.click(), " ": () => this.play(!this.playing),
    };
    canvas.addEventListener("keydown", event => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault(); keys[event.key]();
    });
    canvas.addEventListener("wheel", event => {
      if (document.activeElement !== canvas) return;  // the page scrolls until the body is clicked
      event.preventDefault(); this.zoomBy(Math.exp(-0.0015 * event.deltaY));
    }, { passive: false });
    let from = null, far = 0;
    canvas.addEventListener("pointerdown", event => { from = [event.clientX, event.clientY]; far = 0; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointermove", event => {
      if (!from) return;
      const [dx, dy] = [event.clientX - from[0], event.clientY - from[1]];
      from = [event.clientX, event.clientY]; far += Math.abs(dx) + Math.abs(dy);
      if (event.shiftKey) {
        this.view.x += 2 * dx / canvas.clientWidth; this.view.y -= 2 * dy / canvas.clientHeight; this.draw();
      } else this.turn(0.008 * dx, 0.008 * dy);
    });
    canvas.addEventListener("pointercancel", () => { from = null; });
    canvas.addEventListener("pointerup", event => {
      from = null;
      const box = canvas.getBoundingClientRect();
      if (far < 4) this.probe(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
    });
  }

  probe(x, y) {  // the corner nearest to what is seen at this place of the canvas, -1 to 1
    const axes = this.turned(), seen = new Float32Array(3 * this.count), first = 3 * this.count * this.frame;
    for (let k = 0; k < this.count; k++) {
      const p = [0, 1, 2].map(j => this.points[3 * k + j] + this.pull * this.steps[first + 3 * k + j] / 32767);
      for (let j = 0; j < 3; j++) seen[3 * k + j] = axes[j][0] * p[0] + axes[j][1] * p[1] + axes[j][2] * p[2];
      seen[3 * k] = seen[3 * k] * this.zoom[0] + this.view.x; seen[3 * k + 1] = seen[3 * k + 1] * this.zoom[1] + this.view.y;
    }
    const cut = this.section, beyond = k => cut[0] * this.points[k] + cut[1] * this.points[k + 1] + cut[2] * this.points[k + 2];
    let depth = -Infinity, found = -1;
    for (let t = 0; t < this.triangles.length; t += 3) {
      const [a, b, c] = [0, 1, 2].map(k => 3 * this.triangles[t + k]);
      const area = (seen[b] - seen[a]) * (seen[c + 1] - seen[a + 1]) - (seen[c] - seen[a]) * (seen[b + 1] - seen[a + 1]);
      const v = ((x - seen[a]) * (seen[c + 1] - seen[a + 1]) - (seen[c] - seen[a]) * (y - seen[a + 1])) / area;
      const w = ((seen[b] - seen[a]) * (y - seen[a + 1]) - (x - seen[a]) * (seen[b + 1] - seen[a + 1])) / area;
      if (!(v >= 0 && w >= 0 && v + w <= 1)) continue;
      if ((1 - v - w) * beyond(a) + v * beyond(b) + w * beyond(c) > cut[3]) continue;  // taken away
      const here = (1 - v - w) * seen[a + 2] + v * seen[b + 2] + w * seen[c + 2];
      if (here > depth) { depth = here; found = [[1 - v - w, a], [v, b], [w, c]].sort((p, q) => q[0] - p[0])[0][1] / 3; }
    }
    this.of.probe.textContent = found < 0 ? "Nothing there." : this.told(found);
  }

  told(k) {
    const data = this.data, at = 3 * (this.count * this.frame + k), rate = data.moved / data.finest;
    const place = [0, 1, 2].map(j => (1e3 * (this.points[3 * k + j] + data.centre[j])).toPrecision(4)).join(", ");
    const moved = [0, 1, 2].map(j => (rate * this.steps[at + j]).toPrecision(3));
    const words = [`At (${place}) mm: displacement (${moved.join(", ")}) ${data.modes ? "of the largest" : data.moved_unit}`];
    if (this.values) {
      const step = this.values[this.count * this.frame + k];
      const value = (data.low + (data.high - data.low) * step / (data.untold - 1)).toPrecision(4);
      const beyond = step === data.untold - 1 && data.unit.endsWith("Pa") ? " or more" : "";
      words.push(step === data.untold ? `no ${data.quantity} is told` : `${data.quantity} ${value} ${data.unit}${beyond}`);
    }
    return `${words.join("; ")} (${data.labels[this.frame]})`;
  }
}

window.addEventListener("DOMContentLoaded", () => { for (const figure of document.querySelectorAll("figure.body")) new Body(figure); });
