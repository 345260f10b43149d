#pragma once
// The shaders of scenes and of text. Light is summed in linear colours and written as sRGB.

namespace palpate::runner::display::shaders {

inline constexpr const char* kSolidVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float tint;
uniform mat4 matrix, place;
uniform vec4 cut;
out vec3 at, outward;
out float tinted;
void main() {
  tinted = tint;
  vec4 world = place * vec4(position, 1.0);
  at = world.xyz;
  outward = inverse(transpose(mat3(place))) * normal;
  gl_ClipDistance[0] = dot(cut, world);
  gl_Position = matrix * world;
})";

// A lamp with soft shadows, a hemisphere of sky and ground that is darker below objects, and a rim.
inline constexpr const char* kSolidFragment = R"(#version 330 core
in vec3 at, outward;
in float tinted;
uniform vec3 colour, eye, lamp, ground_colour;
uniform float opacity, softness, sky_softness, grain;
uniform float grid, ground_from, ground_to;  // for the ground only; grid < 0: no lines
uniform vec3 middle;
uniform bool is_ground;
uniform int taps;
uniform mat4 lamp_matrix, sky_matrix;
uniform sampler2DShadow lamp_map, sky_map;
out vec4 result;

vec3 linear(vec3 c) { return pow(c, vec3(2.2)); }

// Mean over a disc of taps that lie on a spiral (Vogel 1979).
float light(sampler2DShadow map, mat4 to_map, vec3 from, float radius, float bias, int count) {
  vec3 p = (to_map * vec4(from, 1.0)).xyz;
  if (count == 0 || any(lessThan(p, vec3(0.0))) || any(greaterThan(p, vec3(1.0)))) return 1.0;
  float sum = 0.0;
  for (int i = 0; i < count; ++i) {
    float r = radius * sqrt((float(i) + 0.5) / float(count)), a = 2.39996323 * float(i);
    sum += texture(map, vec3(p.xy + r * vec2(cos(a), sin(a)), p.z - bias));
  }
  return sum / float(count);
}

float line(float x) {
  float width = fwidth(x);
  float off = abs(fract(x - 0.5) - 0.5);
  return (1.0 - smoothstep(0.6 * width, 1.6 * width, off)) * (1.0 - smoothstep(0.15, 0.5, width));
}

void main() {
  vec3 n = normalize(outward);
  vec3 to_eye = normalize(eye - at);
  if (!gl_FrontFacing) n = -n;
  float facing = dot(n, lamp);
  float sun = facing > 0.0 ? light(lamp_map, lamp_matrix, at + grain * n, softness, 0.002, taps) : 0.0;
  float sky = light(sky_map, sky_matrix, at + 4.0 * grain * n, sky_softness, 0.012, 2 * taps);
  if (is_ground) {
    float far = length(at.xy - middle.xy);
    float dark = 1.0 - (0.62 + 0.38 * sun) * (0.66 + 0.34 * sky);
    float lines = grid > 0.0 ? 0.07 * max(line(at.x / grid), line(at.y / grid)) +
        0.09 * max(line(at.x / (5.0 * grid)), line(at.y / (5.0 * grid))) : 0.0;
    vec3 seen = ground_colour * (1.0 - dark);
    seen = mix(seen, vec3(dot(ground_colour, vec3(0.33)) > 0.4 ? 0.25 : 0.75), lines);
    result = vec4(seen, 1.0 - smoothstep(ground_from, ground_to, far));
    return;
  }
  // Deformation: from the object's colour through yellow to red.
  vec3 base = mix(mix(linear(colour), linear(vec3(0.95, 0.80, 0.35)), min(2.0 * tinted, 1.0)),
                  linear(vec3(0.80, 0.22, 0.20)), clamp(2.0 * tinted - 1.0, 0.0, 1.0));
  vec3 above = vec3(0.50, 0.53, 0.58), below = vec3(0.24, 0.22, 0.21);
  vec3 hemisphere = mix(below, above, 0.5 + 0.5 * n.z) * mix(0.72, 1.0, sky);
  float lit = max(facing, 0.0) * sun;
  float fill = 0.16 * max(dot(n, to_eye), 0.0);
  float shine = 0.10 * sun * pow(max(dot(n, normalize(lamp + to_eye)), 0.0), 40.0);
  float rim = 0.10 * pow(1.0 - max(dot(n, to_eye), 0.0), 3.0) * (0.5 + 0.5 * n.z);
  vec3 sum = base * (hemisphere + fill + vec3(0.74, 0.71, 0.66) * lit) + vec3(shine + rim);
  float veil = opacity < 1.0 ? clamp(opacity + 0.45 * pow(1.0 - abs(dot(n, to_eye)), 2.5), 0.0, 1.0) : 1.0;
  result = vec4(pow(clamp(sum, 0.0, 1.0), vec3(1.0 / 2.2)), veil);
})";

inline constexpr const char* kShadowFragment = R"(#version 330 core
in vec3 at, outward;
void main() {})";

// A triangle over the whole picture.
inline constexpr const char* kBackgroundVertex = R"(#version 330 core
out float height;
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  height = 0.5 + 0.5 * corner.y;
  gl_Position = vec4(corner, 1.0, 1.0);
})";
inline constexpr const char* kBackgroundFragment = R"(#version 330 core
in float height;
uniform vec3 above, below;
out vec4 result;
void main() { result = vec4(mix(below, above, smoothstep(0.0, 1.0, height)), 1.0); })";

// Text: a rectangle in pixels with a texture of premultiplied colours.
inline constexpr const char* kTextVertex = R"(#version 330 core
uniform vec2 corner, size, picture;
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  vec2 pixel = corner + at * size;
  gl_Position = vec4(2.0 * pixel.x / picture.x - 1.0, 1.0 - 2.0 * pixel.y / picture.y, 0.0, 1.0);
})";
inline constexpr const char* kTextFragment = R"(#version 330 core
in vec2 at;
uniform sampler2D text;
out vec4 result;
void main() { result = texture(text, at); })";

}  // namespace palpate::runner::display::shaders
