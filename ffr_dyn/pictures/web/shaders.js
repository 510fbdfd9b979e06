// What the graphics card does.

// Where the points are and what colours them, once for each point of a body: written to a buffer, from which it is drawn.
const MOTION = `#version 300 es
precision highp float; precision highp int; precision highp isampler2D;
in vec3 point; in vec2 moduli;
uniform isampler2D shapes, tensors;
uniform int shapeCount, tensorCount, kind, measure; // kind: 0 plain, 1 displacement, 2 speed, 3 stress, 4 strain
uniform vec3 weights[${MOST_SHAPES}]; // as drawn, as it is, its rate
uniform float stresses[${MOST_TENSORS}];
uniform mat3 A, A0, rateA;
uniform vec3 R, R0, rateR;
uniform float blend;
uniform vec2 range; uniform sampler2D map;
out vec3 place; out float value, shade; // red, green and blue as one whole number

vec3 texel(isampler2D of, int k) { return vec3(texelFetch(of, ivec2(k % ${WIDTH}, k / ${WIDTH}), 0).xyz); }

float von_mises(vec3 n, vec3 s) {
  vec3 d = n - n.yzx;
  return sqrt(0.5 * dot(d, d) + 3.0 * dot(s, s));
}
vec2 principal(vec3 n, vec3 s) { // the largest and the smallest value of a tensor xx, yy, zz; xy, xz, yz
  float mean = (n.x + n.y + n.z) / 3.0;
  vec3 d = n - mean;
  float p = sqrt((dot(d, d) + 2.0 * dot(s, s)) / 6.0);
  if (p == 0.0) return vec2(mean);
  d /= p; s /= p;
  float det = d.x * (d.y * d.z - s.z * s.z) - s.x * (s.x * d.z - s.z * s.y) + s.y * (s.x * s.z - d.y * s.y);
  float angle = acos(clamp(0.5 * det, -1.0, 1.0)) / 3.0;
  return mean + 2.0 * p * cos(vec2(angle, angle + 2.0943951));
}
float measured(vec3 n, vec3 s) {
  if (measure == 0) return von_mises(n, s);
  if (measure > 4) return measure < 8 ? n[measure - 5] : s[measure - 8];
  vec2 ends = principal(n, s);
  if (measure == 1) return ends.x - ends.y;
  if (measure == 2) return abs(ends.x) >= abs(ends.y) ? ends.x : ends.y;
  return measure == 3 ? ends.x : ends.y;
}
void main() {
  vec3 drawn = point, real = point, speed = vec3(0.0);
  for (int k = 0; k < shapeCount; k++) {
    vec3 shape = texel(shapes, gl_VertexID * shapeCount + k);
    drawn += weights[k].x * shape; real += weights[k].y * shape; speed += weights[k].z * shape;
  }
  vec3 rest = R0 + A0 * point;
  value = 0.0;
  if (kind == 1) value = length(R + A * real - rest);
  if (kind == 2) value = length(rateR + rateA * real + A * speed);
  if (kind > 2) {
    vec3 n = vec3(0.0), s = vec3(0.0);
    for (int k = 0; k < tensorCount; k++) {
      int at = 2 * (gl_VertexID * tensorCount + k);
      n += stresses[k] * texel(tensors, at); s += stresses[k] * texel(tensors, at + 1);
    }
    if (kind == 4) { n = ((1.0 + moduli.y) * n - moduli.y * (n.x + n.y + n.z)) / moduli.x; s *= (1.0 + moduli.y) / moduli.x; }
    value = measured(n, s);
  }
  place = mix(rest, R + A * drawn, blend);
  vec3 colour = textureLod(map, vec2(clamp((value - range.x) / (range.y - range.x), 0.0, 1.0), 0.5), 0.0).rgb;
  shade = dot(floor(255.0 * colour + 0.5), vec3(65536.0, 256.0, 1.0));
}`;
const VERTEX = `#version 300 es
precision highp float;
in vec3 point; in float shade;
uniform mat3 A, view; uniform vec3 R, target, zoom, colour; uniform float lift;
uniform bool mapped;
out vec3 eye, base;
void main() {
  eye = view * (R + A * point - target);
  base = mapped ? floor(mod(shade / vec3(65536.0, 256.0, 1.0), 256.0)) / 255.0 : colour;
  gl_Position = vec4(eye.xy * zoom.xy, -eye.z * zoom.z - lift, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 eye, base;
uniform bool shaded; uniform float opacity;
out vec4 pixel;
void main() {
  float light = 1.0;
  if (shaded) {
    vec3 normal = normalize(cross(dFdx(eye), dFdy(eye)));
    light = 0.45 + 0.35 * abs(normal.z) + 0.25 * max(0.0, dot(normal, vec3(-0.41, 0.61, 0.68)));
  }
  pixel = vec4(base * light, opacity);
}`;
