// Colours, shaders and edges of the bodies of a report. Deformed corners are made on the graphics card from steps of the
// largest displacement; shading is that of each flat triangle as it is drawn.
"use strict";
const VIRIDIS = ["440154", "482475", "414487", "355f8d", "2a788e", "21918c", "22a884", "44bf70", "7ad151", "bddf26", "fde725"];
const GREY = [0.847, 0.855, 0.867], INSIDE = [0.84, 0.70, 0.54], UNCUT = [0, 0, 0, 1];
const HOME = { turn: -1.148, lift: 0.514, zoom: 1, x: 0, y: 0 }, SHARP = Math.cos(35 * Math.PI / 180);
const VERTEX = `#version 300 es
in vec3 rest; in vec3 moved; in float value;
uniform mat3 turn; uniform vec3 shift; uniform vec3 zoom; uniform float pull; uniform vec2 scale; uniform bool coloured;
out vec3 place; out vec3 material; out float share; out float told;
void main() {
  material = rest;
  place = turn * (rest + pull * moved);
  share = coloured ? value * scale.x : length(moved) * scale.y;
  told = coloured && value > 0.999995 ? 0.0 : 1.0;
  gl_Position = vec4(place * zoom + shift, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 place; in vec3 material; in float share; in float told;
uniform vec3 colours[11]; uniform vec3 grey; uniform vec3 inside; uniform vec4 cut; uniform bool closed; uniform bool line;
out vec4 colour;
void main() {
  float depth = cut.w - dot(cut.xyz, material), pixel = fwidth(depth);
  if (depth < 0.0) discard;
  if (line) { colour = vec4(0.35, 0.38, 0.42, 1.0); return; }
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float at = clamp(share, 0.0, 1.0) * 10.0; int low = int(min(at, 9.0));
  vec3 own = closed && !gl_FrontFacing ? inside : told < 0.99 ? grey : mix(colours[low], colours[low + 1], at - float(low));
  if (depth < 1.5 * pixel) own = vec3(0.1, 0.12, 0.15);  // the outline of the section
  colour = vec4(own * (0.62 + 0.42 * abs(dot(normal, normalize(vec3(0.3, 0.5, 1.0))))), 1.0);
}`;

function decoded(text, Kind) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new Kind(bytes.buffer);
}

function sharpEdges(points, triangles) {  // pairs of corners between triangles that meet at an angle, or at a rim
  const corner = k => [points[3 * k], points[3 * k + 1], points[3 * k + 2]];
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]], seen = new Map(), found = [];
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map(k => corner(triangles[t + k])), u = minus(b, a), v = minus(c, a);
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]], size = Math.hypot(...n) || 1;
    for (let k = 0; k < 3; k++) {
      const p = triangles[t + k], q = triangles[t + (k + 1) % 3], key = Math.min(p, q) * 4294967296 + Math.max(p, q);
      const other = seen.get(key);
      if (other === undefined) seen.set(key, [n.map(x => x / size), p, q]);
      else {
        if (Math.abs(other[0][0] * n[0] + other[0][1] * n[1] + other[0][2] * n[2]) / size < SHARP) found.push(p, q);
        seen.delete(key);
      }
    }
  }
  for (const [, p, q] of seen.values()) found.push(p, q);
  return new Uint32Array(found);
}
