#include "runner/display/scene/scene_renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <memory>
#include <string>
#include <vector>

#include "runner/display/scene/scene_drawing.h"
#include "runner/display/scene/shaders.h"

namespace palpate::runner::display {
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
  glm::vec3 level(to_viewer.x, to_viewer.y, 0);
  // From above: as if from the front.
  level = glm::length(level) > 1e-3F ? glm::normalize(level) : glm::vec3(0, -1, 0);
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
  if (!picture.with_ground || camera.eye().z <= picture.ground) return;  // it would hide everything
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
