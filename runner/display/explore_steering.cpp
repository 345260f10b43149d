// What the pointer does over ExploreView's picture.

#include <imgui.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "runner/display/explore_view.h"

namespace palpate::runner {
namespace {

constexpr float kOrbitPerPixel = 0.008F;  // rad
constexpr float kZoomPerNotch = 1.12F;
constexpr ImU32 kQuietInk = IM_COL32(150, 158, 168, 255);

}  // namespace

std::string ExploreView::hint() const {
  if (!not_pulled_.empty()) return not_pulled_;
  if (const double away = source_.away(); away > 0)
    return "It goes on once the stylus is back where it was: " +
           std::to_string(std::lround(1000 * away)) + " mm away";
  if (!control_ || timeline_.state() != Timeline::State::following)
    return "drag: look    middle or Shift: move    wheel: nearer";
  const SceneMoment* const shown = timeline_.shown();
  if (shown != nullptr && !shown->poses.empty())
    return "pointer: the tip    wheel: press    left: turn    Shift and left: pull an object    "
           "right: look";
  return "pointer: the tip    wheel: press harder    left: turn    right: look    middle: move";
}

/// The axes of the world, in the picture's lower right corner.
void ExploreView::draw_axes(float right, float low) const {
  const float font = ImGui::GetFontSize();
  const glm::vec2 foot(right - 3.2F * font, low - 3.2F * font);
  // As the camera sees them at the place that it looks at.
  const glm::vec2 middle = camera_.project(camera_.centre());
  const float unit = 0.01F * camera_.distance();
  constexpr std::array<const char*, 3> kNames{"x", "y", "z"};
  constexpr std::array<ImU32, 3> kInks{IM_COL32(225, 96, 92, 255), IM_COL32(104, 190, 110, 255),
                                       IM_COL32(96, 150, 235, 255)};
  glm::vec3 one(0, 0, 1);
  const float most =
      glm::length(camera_.project(camera_.centre() + unit * glm::normalize(glm::cross(
                                                                one, camera_.towards_viewer()))) -
                  middle);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  for (int i = 0; i < 3; ++i) {
    one = glm::vec3(0);
    one[i] = unit;
    const glm::vec2 along = 2.1F * font / most * (camera_.project(camera_.centre() + one) - middle);
    const glm::vec2 end = foot + along, name = foot + 1.3F * along;
    const auto k = static_cast<std::size_t>(i);
    list.AddLine({foot.x, foot.y}, {end.x, end.y}, kInks[k], 2);
    const ImVec2 size = ImGui::CalcTextSize(kNames[k]);
    list.AddText({name.x - size.x / 2, name.y - size.y / 2}, kInks[k], kNames[k]);
  }
}

void ExploreView::draw_over_scene(float x, float y, float width, float height) const {
  const float font = ImGui::GetFontSize();
  draw_axes(x + width, y + height);
  ImGui::GetWindowDrawList()->AddText({x + 0.8F * font, y + height - 1.6F * font}, kQuietInk,
                                      hint().c_str());
}

/// Shift and the left button draw an object that moves, at the place under the pointer, in the
/// plane of the picture. \return whether one is drawn, or asked for that cannot be
bool ExploreView::pull(const Modifiers& modifiers, const glm::vec2& at, bool left) {
  const SceneMoment* const shown = timeline_.shown();
  const bool wanted = left && modifiers.shift && shown != nullptr && source_.live() &&
                      timeline_.state() == Timeline::State::following;
  if (!wanted) {
    if (pull_.object >= 0) source_.pull(pull_ = {});
    not_pulled_.clear();
    return false;
  }
  if (!not_pulled_.empty()) return true;
  if (pull_.object < 0) {
    const glm::vec3 eye = camera_.eye();
    const auto hit = settings_.drawing.hit(
        eye, glm::normalize(camera_.unproject(at, camera_.centre()) - eye), shown->poses);
    if (!hit) return false;
    const stimuli::ObjectSpec& object = settings_.objects[hit->object];
    if (!object.body || hit->object >= shown->poses.size()) {
      not_pulled_ = settings_.drawing.label(hit->object) +
                    (object.soft ? " is soft: press it with the stylus; what moves as a whole "
                                   "(\"body\") can be pulled"
                                 : " stands still: what moves (\"body\") can be pulled");
      return true;
    }
    const Pose& now = shown->poses[hit->object];
    const Pose& first = settings_.objects[hit->object].pose;
    const Vec3 local = glm::conjugate(now.orientation) * (Vec3(hit->place) - now.position);
    pull_.object = static_cast<int>(hit->object);
    pull_.on_object = first.orientation * local + first.position;
    pulled_from_ = hit->place;
  }
  pull_.to = Vec3(camera_.unproject(at, pulled_from_));
  source_.pull(pull_);
  return true;
}

void ExploreView::steer(const Modifiers& modifiers, float x, float y) {
  const ImGuiIO& io = ImGui::GetIO();
  const bool over = ImGui::IsItemHovered(), active = ImGui::IsItemActive();
  const bool touches = control_ && goes_on_ && timeline_.state() == Timeline::State::following;
  PointerMotion pointer;
  pointer.over = over || active;
  pointer.at = {io.MousePos.x - x, io.MousePos.y - y};
  pointer.moved = {io.MouseDelta.x, io.MouseDelta.y};
  pointer.wheel = over ? io.MouseWheel : 0;
  const bool left = active && ImGui::IsMouseDown(ImGuiMouseButton_Left);
  const bool middle = active && ImGui::IsMouseDown(ImGuiMouseButton_Middle);
  pointer.orbit = active && ImGui::IsMouseDown(ImGuiMouseButton_Right);
  if (middle || (left && !touches && modifiers.shift)) {
    camera_.pan(pointer.moved);
    pointer.orbit = touches;  // the stylus stays
  } else if (pointer.orbit || (left && !touches)) {
    camera_.orbit(-kOrbitPerPixel * pointer.moved.x, kOrbitPerPixel * pointer.moved.y);
  }
  if (pull(modifiers, pointer.at, left)) return;
  const SceneMoment* const shown = timeline_.shown();
  const auto line_of_sight = [&](const glm::vec3& from, const glm::vec3& along) {
    return settings_.drawing.hit(from, along, shown ? shown->poses : std::vector<Pose>());
  };
  under_pointer_.clear();
  if (over) {
    const glm::vec3 eye = camera_.eye();
    const auto hit =
        line_of_sight(eye, glm::normalize(camera_.unproject(pointer.at, camera_.centre()) - eye));
    if (hit) under_pointer_ = settings_.drawing.label(hit->object);
  }
  if (!touches) {
    if (pointer.wheel != 0) camera_.zoom(std::pow(kZoomPerNotch, pointer.wheel));
    return;
  }
  pointer.turn = modifiers.ctrl || left;
  pointer.depth = modifiers.shift;
  control_->step(pointer, camera_,
                 [&](const glm::vec3& from, const glm::vec3& along) -> std::optional<glm::vec3> {
                   const auto hit = line_of_sight(from, along);
                   if (!hit) return std::nullopt;
                   return hit->place;
                 });
}

}  // namespace palpate::runner
