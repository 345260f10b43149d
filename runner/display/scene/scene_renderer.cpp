#include "runner/display/scene/scene_renderer.h"

#include <epoxy/gl.h>
#include <pango/pangocairo.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "runner/display/scene/picture.h"
#include "runner/display/scene/scene_drawing.h"

namespace palpate::runner::display {

// A line of text as an image, set by Pango.

struct TextImage {
  int width = 0, height = 0;        ///< px
  std::vector<unsigned char> bgra;  ///< premultiplied, rows from the top
};

/// \param size  px, of the font. \param halo  colour around the letters, so that they are readable
/// on any background
TextImage text_image(const std::string& text, double size, const glm::vec3& colour,
                     const glm::vec3& halo);

namespace {

constexpr const char* kLabelFont = "Noto Sans, DejaVu Sans, Sans Medium";
constexpr double kHaloWidth = 0.22, kHaloOpacity = 0.75;  // of the font's size

struct ReleaseObject {
  void operator()(PangoLayout* layout) const { g_object_unref(layout); }
  void operator()(PangoFontDescription* font) const { pango_font_description_free(font); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* canvas) const { cairo_destroy(canvas); }
  void operator()(char* text) const { g_free(text); }
};
template <class T>
using Owned = std::unique_ptr<T, ReleaseObject>;

Owned<PangoLayout> laid_out(cairo_t* canvas, const std::string& text, double size) {
  Owned<PangoLayout> layout(pango_cairo_create_layout(canvas));
  const Owned<char> valid(g_utf8_make_valid(text.data(), static_cast<gssize>(text.size())));
  pango_layout_set_text(layout.get(), valid.get(), -1);
  const Owned<PangoFontDescription> font(pango_font_description_from_string(kLabelFont));
  pango_font_description_set_absolute_size(font.get(), pango_units_from_double(size));
  pango_layout_set_font_description(layout.get(), font.get());
  return layout;
}

}  // namespace

TextImage text_image(const std::string& text, double size, const glm::vec3& colour,
                     const glm::vec3& halo) {
  const double border = std::ceil(kHaloWidth * size);
  const Owned<cairo_surface_t> probe(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, 1, 1));
  const Owned<cairo_t> measure(cairo_create(probe.get()));
  PangoRectangle box;
  pango_layout_get_pixel_extents(laid_out(measure.get(), text, size).get(), nullptr, &box);
  TextImage out;
  out.width = box.width + static_cast<int>(2 * border);
  out.height = box.height + static_cast<int>(2 * border);
  const Owned<cairo_surface_t> surface(
      cairo_image_surface_create(CAIRO_FORMAT_ARGB32, out.width, out.height));
  const Owned<cairo_t> canvas(cairo_create(surface.get()));
  const Owned<PangoLayout> layout = laid_out(canvas.get(), text, size);
  cairo_move_to(canvas.get(), border, border);
  pango_cairo_layout_path(canvas.get(), layout.get());
  cairo_set_line_join(canvas.get(), CAIRO_LINE_JOIN_ROUND);
  cairo_set_line_width(canvas.get(), kHaloWidth * size);
  cairo_set_source_rgba(canvas.get(), halo.x, halo.y, halo.z, kHaloOpacity);
  cairo_stroke_preserve(canvas.get());
  cairo_set_source_rgb(canvas.get(), colour.x, colour.y, colour.z);
  cairo_fill(canvas.get());
  cairo_surface_flush(surface.get());
  const auto row = static_cast<std::size_t>(out.width) * 4;
  out.bgra.resize(row * static_cast<std::size_t>(out.height));
  const unsigned char* const data = cairo_image_surface_get_data(surface.get());
  const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(surface.get()));
  for (std::size_t y = 0; data != nullptr && y < static_cast<std::size_t>(out.height); ++y)
    std::memcpy(&out.bgra[y * row], data + y * stride, row);
  return out;
}

GlText::GlText() : program_(shaders::kTextVertex, shaders::kTextFragment) {
  glGenVertexArrays(1, &nothing_);
}

GlText::~GlText() {
  for (const auto& [text, known] : known_) glDeleteTextures(1, &known.texture);
  glDeleteVertexArrays(1, &nothing_);
}

void GlText::begin(const glm::vec2& picture, double size, const Theme& theme) {
  if (size != size_ || &theme != theme_) {
    for (const auto& [text, known] : known_) glDeleteTextures(1, &known.texture);
    known_.clear();
  }
  picture_ = picture;
  size_ = size;
  theme_ = &theme;
  for (auto& [text, known] : known_) known.used = false;
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  program_.use();
  program_.set("picture", picture_);
  program_.set("text", 0);
  glBindVertexArray(nothing_);
}

const GlText::Known& GlText::known(const std::string& text) {
  Known& out = known_[text];
  out.used = true;
  if (out.texture != 0) return out;
  const TextImage image = text_image(text, size_, theme_->text, theme_->halo);
  out.size = {image.width, image.height};
  glGenTextures(1, &out.texture);
  glBindTexture(GL_TEXTURE_2D, out.texture);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, image.width, image.height, 0, GL_BGRA, GL_UNSIGNED_BYTE,
               image.bgra.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return out;
}

void GlText::draw(const std::string& text, const glm::vec2& at, TextAnchor anchor) {
  if (text.empty()) return;
  const Known& image = known(text);
  glm::vec2 corner = at;
  if (anchor == TextAnchor::left) corner.y -= image.size.y / 2;
  if (anchor == TextAnchor::centre) corner -= 0.5F * image.size;
  if (anchor == TextAnchor::lower_left) corner.y -= image.size.y;
  program_.set("corner", glm::vec2(std::round(corner.x), std::round(corner.y)));
  program_.set("size", image.size);
  glBindTexture(GL_TEXTURE_2D, image.texture);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

void GlText::end() {
  for (auto it = known_.begin(); it != known_.end();) {
    if (it->second.used) {
      ++it;
      continue;
    }
    glDeleteTextures(1, &it->second.texture);
    it = known_.erase(it);
  }
  glDisable(GL_BLEND);
}

namespace {

constexpr int kOldest = 33;  // OpenGL 3.3

std::string named_by_driver(GLenum what) {
  const auto* const text = reinterpret_cast<const char*>(glGetString(what));
  return text == nullptr ? "unknown" : text;
}

unsigned compiled(GLenum kind, const char* source) {
  const unsigned shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  int good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good != 0) return shader;
  char why[400] = {};
  glGetShaderInfoLog(shader, sizeof why - 1, nullptr, why);
  glDeleteShader(shader);
  throw DisplayError("the graphics driver (" + named_by_driver(GL_RENDERER) +
                     ") refused a shader: " + why);
}

void expect_whole_frame() {
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return;
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  throw DisplayError("the graphics driver (" + named_by_driver(GL_RENDERER) +
                     ") cannot draw a picture of this size");
}

}  // namespace

void require_opengl() {
  const int version = epoxy_gl_version();
  if (version >= kOldest && epoxy_is_desktop_gl()) return;
  throw DisplayError("scenes are drawn with OpenGL 3.3; this is " + named_by_driver(GL_VERSION) +
                     " (" + named_by_driver(GL_RENDERER) + ")");
}

bool draws_in_software() {
  const std::string name = named_by_driver(GL_RENDERER);
  return std::ranges::any_of(
      std::initializer_list<const char*>{"llvmpipe", "softpipe", "Software", "unknown"},
      [&name](const char* known) { return name.find(known) != std::string::npos; });
}

void finish_target() {
  if (draws_in_software()) glFinish();
}

void check_opengl(const char* doing) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  while (glGetError() != GL_NO_ERROR) {  // one message is enough
  }
  throw DisplayError(std::string(doing) + ": OpenGL reports error " + std::to_string(error) + " (" +
                     named_by_driver(GL_RENDERER) + ")" +
                     (error == GL_OUT_OF_MEMORY ? ": out of memory; try a smaller picture" : ""));
}

GlMesh::GlMesh(const DrawnMesh& mesh) : corners_(static_cast<int>(mesh.size())) {
  glGenVertexArrays(1, &vertices_);
  glGenBuffers(1, &buffer_);
  glBindVertexArray(vertices_);
  glBindBuffer(GL_ARRAY_BUFFER, buffer_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.size() * sizeof(DrawnVertex)),
               mesh.data(), GL_STATIC_DRAW);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(DrawnVertex), nullptr);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): an offset, as OpenGL asks for it
  const void* const normals = reinterpret_cast<const void*>(offsetof(DrawnVertex, normal));
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(DrawnVertex), normals);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): likewise
  const void* const tints = reinterpret_cast<const void*>(offsetof(DrawnVertex, tint));
  glVertexAttribPointer(2, 1, GL_FLOAT, GL_FALSE, sizeof(DrawnVertex), tints);
  for (const GLuint attribute : {0U, 1U, 2U}) glEnableVertexAttribArray(attribute);
  glBindVertexArray(0);
}

GlMesh::~GlMesh() {
  glDeleteVertexArrays(1, &vertices_);
  glDeleteBuffers(1, &buffer_);
}

void GlMesh::draw() const {
  glBindVertexArray(vertices_);
  glDrawArrays(GL_TRIANGLES, 0, corners_);
}

GlProgram::GlProgram(const char* vertex_shader, const char* fragment_shader) {
  const unsigned vertex = compiled(GL_VERTEX_SHADER, vertex_shader);
  const unsigned fragment = compiled(GL_FRAGMENT_SHADER, fragment_shader);
  program_ = glCreateProgram();
  glAttachShader(program_, vertex);
  glAttachShader(program_, fragment);
  glLinkProgram(program_);
  glDeleteShader(vertex);
  glDeleteShader(fragment);
  int good = 0;
  glGetProgramiv(program_, GL_LINK_STATUS, &good);
  if (good != 0) return;
  glDeleteProgram(program_);
  throw DisplayError("the graphics driver (" + named_by_driver(GL_RENDERER) +
                     ") could not link a shader");
}

GlProgram::~GlProgram() { glDeleteProgram(program_); }

void GlProgram::use() const { glUseProgram(program_); }

int GlProgram::place_of(const char* name) const { return glGetUniformLocation(program_, name); }

void GlProgram::set(const char* name, float value) const { glUniform1f(place_of(name), value); }
void GlProgram::set(const char* name, int value) const { glUniform1i(place_of(name), value); }
void GlProgram::set(const char* name, const glm::vec2& value) const {
  glUniform2fv(place_of(name), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* name, const glm::vec3& value) const {
  glUniform3fv(place_of(name), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* name, const glm::vec4& value) const {
  glUniform4fv(place_of(name), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* name, const glm::mat4& value) const {
  glUniformMatrix4fv(place_of(name), 1, GL_FALSE, glm::value_ptr(value));
}

GlCanvas::~GlCanvas() { discard(); }

void GlCanvas::discard() {
  if (width_ == 0) return;
  for (const unsigned* frame : {&samples_frame_, &frame_}) glDeleteFramebuffers(1, frame);
  for (const unsigned* part : {&samples_colour_, &samples_depth_}) glDeleteRenderbuffers(1, part);
  glDeleteTextures(1, &texture_);
  width_ = 0;
}

void GlCanvas::begin(int width, int height, int samples) {
  if (width == width_ && height == height_ && samples == samples_) {
    glBindFramebuffer(GL_FRAMEBUFFER, samples_frame_);
    glViewport(0, 0, width_, height_);
    return;
  }
  discard();
  int largest = 0, most = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &largest);
  glGetIntegerv(GL_MAX_SAMPLES, &most);
  if (width > largest || height > largest)
    throw DisplayError("the graphics driver draws pictures of at most " + std::to_string(largest) +
                       " px a side");
  width_ = width;
  height_ = height;
  samples_ = samples;
  glGenFramebuffers(1, &samples_frame_);
  glGenRenderbuffers(1, &samples_colour_);
  glGenRenderbuffers(1, &samples_depth_);
  glGenTextures(1, &texture_);
  glGenFramebuffers(1, &frame_);
  const auto storage = [&](unsigned part, GLenum format, GLenum place) {
    glBindRenderbuffer(GL_RENDERBUFFER, part);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, std::min(samples, most), format, width,
                                     height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, place, GL_RENDERBUFFER, part);
  };
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
  expect_whole_frame();
  glBindFramebuffer(GL_FRAMEBUFFER, samples_frame_);
  storage(samples_colour_, GL_RGBA8, GL_COLOR_ATTACHMENT0);
  storage(samples_depth_, GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT);
  expect_whole_frame();
  glViewport(0, 0, width_, height_);
}

void GlCanvas::end() const {
  finish_target();
  glBindFramebuffer(GL_READ_FRAMEBUFFER, samples_frame_);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, frame_);
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  finish_target();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

std::string GlCanvas::pixels() const {
  const auto row = static_cast<std::size_t>(width_) * 3;
  std::string from_below(row * static_cast<std::size_t>(height_), '\0'),
      out(from_below.size(), '\0');
  glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, from_below.data());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
  for (std::size_t y = 0; y < static_cast<std::size_t>(height_); ++y)
    std::memcpy(&out[y * row], &from_below[(static_cast<std::size_t>(height_) - 1 - y) * row], row);
  return out;
}

GlDepthMap::GlDepthMap(int size) : size_(size) {
  glGenTextures(1, &texture_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, size, size, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
               nullptr);
  const auto set = [](GLenum name, GLint value) { glTexParameteri(GL_TEXTURE_2D, name, value); };
  set(GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  set(GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  set(GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  set(GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  set(GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  set(GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  const glm::vec4 lit(1);
  glTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, glm::value_ptr(lit));
  glGenFramebuffers(1, &frame_);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, texture_, 0);
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  expect_whole_frame();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

GlDepthMap::~GlDepthMap() {
  glDeleteFramebuffers(1, &frame_);
  glDeleteTextures(1, &texture_);
}

void GlDepthMap::begin() const {
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glViewport(0, 0, size_, size_);
  glClear(GL_DEPTH_BUFFER_BIT);
}

void GlDepthMap::read_as(int unit) const {
  glActiveTexture(GL_TEXTURE0 + static_cast<unsigned>(unit));
  glBindTexture(GL_TEXTURE_2D, texture_);
  glActiveTexture(GL_TEXTURE0);
}

namespace {

// In sizes of the scene.
constexpr float kLampSoftness = 0.030F, kSkySoftness = 0.22F, kGrain = 0.012F;
constexpr float kGroundEdge = 12, kGroundFrom = 1.6F, kGroundTo = 5.5F;
constexpr float kOverTranslucent = 0.5F;
constexpr float kShadowReach = 1.7F;
constexpr float kTurnHead = 7;  // in thicknesses of the arc
constexpr int kSkyMap = 96;     // coarse: its texels blend

constexpr glm::vec4 kNoCut{0, 0, 0, 1};

DrawnMesh unit_square() {
  const glm::vec3 up(0, 0, 1), a(-1, 1, 0), b(-1, -1, 0), c(1, -1, 0), d(1, 1, 0);
  return {{a, up}, {b, up}, {c, up}, {a, up}, {c, up}, {d, up}};
}

/// Direction to a lamp above the viewer's left shoulder, wherever the camera is.
glm::vec3 lamp_of(const Camera& camera) {
  const glm::vec3 to_viewer = camera.towards_viewer();
  const glm::vec3 level = glm::normalize(glm::vec3(to_viewer.x, to_viewer.y, 0));
  const glm::vec3 right(-level.y, level.x, 0);
  return glm::normalize(0.45F * level - 0.62F * right + glm::vec3(0, 0, 1));
}

/// Maps to the unit cube of a shadow map: x and y across, z along the light.
glm::mat4 light_view(const ScenePicture& picture, const glm::vec3& towards_light) {
  const float reach = kShadowReach * picture.size;
  const glm::vec3 up = std::abs(towards_light.z) > 0.99F ? glm::vec3(0, 1, 0) : glm::vec3(0, 0, 1);
  return glm::ortho(-reach, reach, -reach, reach, 0.0F, 4 * reach) *
         glm::lookAt(picture.middle + 2 * reach * towards_light, picture.middle, up);
}

glm::mat4 to_unit(const glm::mat4& clip) {
  return glm::translate(glm::mat4(1), glm::vec3(0.5F)) * glm::scale(glm::mat4(1), glm::vec3(0.5F)) *
         clip;
}

bool translucent(const DrawnObject& object) { return object.opacity < 1; }

}  // namespace

SceneRenderer::SceneRenderer(const DrawingQuality& quality)
    : quality_((require_opengl(), quality)),
      solid_(shaders::kSolidVertex, shaders::kSolidFragment),
      shadow_(shaders::kSolidVertex, shaders::kShadowFragment),
      background_(shaders::kBackgroundVertex, shaders::kBackgroundFragment),
      cylinder_(unit_cylinder()),
      cone_(unit_cone()),
      sphere_(unit_sphere()),
      square_(unit_square()),
      lamp_map_(quality.shadow_map),
      sky_map_(std::min(kSkyMap, quality.shadow_map)) {
  check_opengl("preparing to draw scenes");
}

DrawingQuality SceneRenderer::live_quality() {
  return draws_in_software() ? DrawingQuality{0, 4, 512} : DrawingQuality{};
}

const GlMesh& SceneRenderer::uploaded(const std::shared_ptr<const DrawnMesh>& mesh) {
  Uploaded& out = meshes_[mesh.get()];
  if (out.on_card == nullptr) {
    out.on_card = std::make_unique<GlMesh>(*mesh);
    out.mesh = mesh;
  }
  out.used = true;
  return *out.on_card;
}

void SceneRenderer::forget_unused() {
  std::erase_if(meshes_, [](const auto& known) { return !known.second.used; });
  for (auto& [mesh, known] : meshes_) known.used = false;
}

std::vector<SceneRenderer::Item> SceneRenderer::tool_items(const ScenePicture& picture,
                                                           const Camera& camera) const {
  std::vector<Item> items;
  const auto ball = [&](const glm::vec3& at, float radius, const glm::vec3& colour, float through) {
    items.push_back({&sphere_, ball_place(at, radius), colour, through});
  };
  for (const DrawnRod& rod : picture.rods) {
    const float radius = radius_seen(rod, camera);
    items.push_back({&cylinder_, rod_place(rod.from, rod.to, radius), rod.colour, rod.through});
    for (const glm::vec3& end : {rod.from, rod.to}) ball(end, radius, rod.colour, rod.through);
  }
  for (const DrawnBall& drawn : picture.balls)
    ball(drawn.centre, drawn.radius, drawn.colour, drawn.through);
  const std::size_t first_sign = items.size();
  const auto arrow = [&](const glm::vec3& from, const glm::vec3& to, float radius,
                         const glm::vec3& colour) {
    const ArrowPlaces places = arrow_places(from, to, radius);
    items.push_back({&cylinder_, places.shaft, colour, 0.5F});
    items.push_back({&cone_, places.head, colour, 0.5F});
  };
  for (const DrawnArrow& drawn : picture.arrows)
    arrow(drawn.from, drawn.from + drawn.by, drawn.radius, drawn.colour);
  for (const DrawnTurn& turn : picture.turns) {
    const std::vector<glm::vec3> path = points_of(turn);
    // The head has the length of an arrow's, or takes half of a short arc.
    const float head = std::min(kTurnHead * turn.thickness / turn.radius, 0.5F * turn.sweep);
    const auto last =
        static_cast<std::size_t>((1 - head / turn.sweep) * static_cast<float>(path.size() - 1));
    for (std::size_t i = 0; i < last; ++i) {
      items.push_back(
          {&cylinder_, rod_place(path[i], path[i + 1], turn.thickness), turn.colour, 0.5F});
      ball(path[i + 1], turn.thickness, turn.colour, 0.5F);
    }
    const glm::vec3 &neck = path[last], &end = path.back();
    items.push_back(
        {&cone_,
         rod_place(neck, end, std::min(2.8F * turn.thickness, 0.5F * glm::distance(neck, end))),
         turn.colour, 0.5F});
  }
  for (std::size_t i = first_sign; i < items.size(); ++i) items[i].is_sign = true;
  return items;
}

void SceneRenderer::draw_shadows(const ScenePicture& picture, const std::vector<Item>& items) {
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glEnable(GL_CLIP_DISTANCE0);
  shadow_.use();
  shadow_.set("cut", picture.cut.value_or(kNoCut));
  const auto draw_from = [&](const GlDepthMap& map, const glm::mat4& view) {
    map.begin();
    shadow_.set("matrix", view);
    for (const DrawnObject& object : picture.objects) {
      if (object.layer > 0) continue;  // inside an object that casts one
      shadow_.set("place", object.place);
      uploaded(object.mesh).draw();
    }
    glDisable(GL_CLIP_DISTANCE0);
    for (const Item& item : items) {
      if (item.is_sign) continue;
      shadow_.set("place", item.place);
      item.mesh->draw();
    }
    glEnable(GL_CLIP_DISTANCE0);
    finish_target();
  };
  draw_from(lamp_map_, lamp_view_);
  draw_from(sky_map_, sky_view_);
  glDisable(GL_CLIP_DISTANCE0);
}

void SceneRenderer::prepare_light(const ScenePicture& picture, const Camera& camera,
                                  const Theme& theme) const {
  constexpr float kAcross = 2 * kShadowReach;  // width of a map, in sizes
  solid_.use();
  solid_.set("matrix", camera.matrix());
  solid_.set("eye", camera.eye());
  solid_.set("lamp", lamp_);
  solid_.set("lamp_matrix", to_unit(lamp_view_));
  solid_.set("sky_matrix", to_unit(sky_view_));
  solid_.set("lamp_map", 1);
  solid_.set("sky_map", 2);
  lamp_map_.read_as(1);
  sky_map_.read_as(2);
  solid_.set("softness", kLampSoftness / kAcross);
  solid_.set("sky_softness", kSkySoftness / kAcross);
  solid_.set("grain", kGrain * picture.size);
  solid_.set("taps", quality_.taps);
  solid_.set("ground_colour", theme.ground);
  solid_.set("middle", picture.middle);
  solid_.set("ground_from", kGroundFrom * picture.size);
  solid_.set("ground_to", kGroundTo * picture.size);
  solid_.set("grid", picture.grid);
  solid_.set("is_ground", 0);
  solid_.set("cut", kNoCut);
  solid_.set("opacity", 1.0F);
  solid_.set("taps", quality_.taps);
}

/// Draws parts behind or in front of translucent objects again, faintly, so that they stay visible.
void SceneRenderer::draw_over_translucent(const ScenePicture& picture,
                                          const std::vector<Item>& items) const {
  if (std::ranges::none_of(picture.objects, translucent)) return;
  glDepthFunc(GL_LEQUAL);
  glEnable(GL_BLEND);
  glBlendFunc(GL_CONSTANT_ALPHA, GL_ONE_MINUS_CONSTANT_ALPHA);
  glBlendColor(0, 0, 0, kOverTranslucent);
  for (const Item& item : items) draw_item(item);
  glDisable(GL_BLEND);
  glDepthFunc(GL_LESS);
}

void SceneRenderer::draw_background(const Theme& theme) const {
  glDisable(GL_DEPTH_TEST);
  background_.use();
  background_.set("above", theme.above);
  background_.set("below", theme.below);
  square_.draw();  // any vertices will do: the shader computes positions from their indices
}

void SceneRenderer::draw_ground(const ScenePicture& picture, const Camera& camera) const {
  if (camera.eye().z <= picture.ground) return;  // it would hide everything
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(GL_FALSE);  // objects below the ground stay visible
  solid_.set("is_ground", 1);
  const glm::vec3 at(picture.middle.x, picture.middle.y, picture.ground);
  solid_.set("place",
             glm::scale(glm::translate(glm::mat4(1), at), glm::vec3(kGroundEdge * picture.size)));
  square_.draw();
  solid_.set("is_ground", 0);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
}

void SceneRenderer::draw_item(const Item& item) const {
  solid_.set("place", item.place);
  solid_.set("colour", item.colour);
  item.mesh->draw();
}

void SceneRenderer::draw_opaque_objects(const ScenePicture& picture) const {
  solid_.set("cut", picture.cut.value_or(kNoCut));
  glEnable(GL_CLIP_DISTANCE0);
  for (const DrawnObject& object : picture.objects) {
    if (translucent(object)) continue;
    solid_.set("place", object.place);
    solid_.set("colour", object.colour);
    meshes_.at(object.mesh.get()).on_card->draw();
  }
  glDisable(GL_CLIP_DISTANCE0);
  solid_.set("cut", kNoCut);
}

// Draw far objects first. Of nested ones draw the backs from outside to inside, then the fronts
// from inside to outside.
void SceneRenderer::draw_translucent_objects(const ScenePicture& picture,
                                             const Camera& camera) const {
  std::map<int, std::vector<const DrawnObject*>> of;
  for (const DrawnObject& object : picture.objects)
    if (translucent(object)) of[object.object].push_back(&object);
  const auto distance = [&](const DrawnObject& object) {
    return glm::distance(glm::vec3(object.place[3]), camera.eye());
  };
  std::vector<std::vector<const DrawnObject*>> nested;
  for (auto& [index, shells] : of) {
    std::ranges::stable_sort(shells, {}, &DrawnObject::layer);
    nested.push_back(shells);
  }
  std::ranges::stable_sort(nested, [&](const auto& a, const auto& b) {
    return distance(*a.front()) > distance(*b.front());
  });
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(GL_FALSE);
  glEnable(GL_CULL_FACE);
  glEnable(GL_CLIP_DISTANCE0);
  solid_.set("cut", picture.cut.value_or(kNoCut));
  solid_.set("taps", 0);  // no shadows: light passes through
  const auto draw = [&](const DrawnObject& object, GLenum culled, float opacity) {
    glCullFace(culled);
    solid_.set("place", object.place);
    solid_.set("colour", object.colour);
    solid_.set("opacity", opacity);
    meshes_.at(object.mesh.get()).on_card->draw();
  };
  for (const auto& shells : nested) {
    for (auto it = shells.begin(); it != shells.end(); ++it)
      draw(**it, GL_FRONT, 0.5F * (*it)->opacity);
    for (auto it = shells.rbegin(); it != shells.rend(); ++it) draw(**it, GL_BACK, (*it)->opacity);
  }
  glDisable(GL_CLIP_DISTANCE0);
  glDisable(GL_CULL_FACE);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
  solid_.set("cut", kNoCut);
  solid_.set("opacity", 1.0F);
}

void SceneRenderer::draw_hidden(const std::vector<Item>& items) const {
  glDepthFunc(GL_GREATER);
  glDepthMask(GL_FALSE);
  glEnable(GL_CULL_FACE);
  glCullFace(GL_BACK);
  glEnable(GL_BLEND);
  glBlendFunc(GL_CONSTANT_ALPHA, GL_ONE_MINUS_CONSTANT_ALPHA);
  for (const Item& item : items) {
    if (!(item.through > 0)) continue;
    glBlendColor(0, 0, 0, item.through);
    draw_item(item);
  }
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
}

void SceneRenderer::draw_texts(const ScenePicture& picture, const Camera& camera,
                               const Theme& theme, const glm::vec2& size) {
  const double font = std::max(11.0, std::round(size.y / 36.0));
  text_.begin(size, font, theme);
  const auto step = static_cast<float>(1.5 * font);
  std::vector<LabelBox> boxes;
  for (const DrawnLabel& label : picture.labels) {
    if (!camera.in_front(label.at)) continue;
    boxes.push_back({camera.project(label.at), text_.size_of(label.text),
                     glm::distance(label.at, camera.eye()), &label.text});
  }
  const float captions = step * static_cast<float>(picture.caption.size());
  place_labels(boxes, {size.x, size.y - captions});
  for (const LabelBox& box : boxes)
    if (box.shown) text_.draw(*box.text, box.centre, TextAnchor::centre);
  float y = size.y - static_cast<float>(0.5 * font);
  for (auto line = picture.caption.rbegin(); line != picture.caption.rend(); ++line, y -= step)
    text_.draw(*line, {0.7 * font, y}, TextAnchor::lower_left);
  text_.end();
}

unsigned SceneRenderer::draw(const ScenePicture& picture, const Camera& camera, const Theme& theme,
                             int width, int height) {
  const int across = std::max(width, 1), high = std::max(height, 1);
  lamp_ = lamp_of(camera);
  lamp_view_ = light_view(picture, lamp_);
  sky_view_ = light_view(picture, {0, 0, 1});
  for (const DrawnObject& object : picture.objects) uploaded(object.mesh);
  const std::vector<Item> items = tool_items(picture, camera);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_BLEND);
  draw_shadows(picture, items);
  canvas_.begin(across, high, quality_.samples);
  glClear(GL_DEPTH_BUFFER_BIT);
  draw_background(theme);
  glEnable(GL_DEPTH_TEST);
  prepare_light(picture, camera, theme);
  draw_ground(picture, camera);
  draw_opaque_objects(picture);
  draw_hidden(items);
  for (const Item& item : items) draw_item(item);
  draw_translucent_objects(picture, camera);
  draw_over_translucent(picture, items);
  draw_texts(picture, camera, theme, {across, high});
  glBindVertexArray(0);
  glUseProgram(0);
  canvas_.end();
  forget_unused();
  check_opengl("drawing a scene");
  return canvas_.texture();
}

}  // namespace palpate::runner::display
