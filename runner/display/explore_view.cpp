#include "runner/display/explore_view.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>

#include "runner/display/console_panels.h"
#include "runner/display/console_widgets.h"
#include "runner/display/scene/image_file.h"
#include "runner/servo/servo_fault.h"

namespace palpate::runner {
namespace {

constexpr double kWindowThickness = 1.3;  // of the tool
constexpr float kOrbitPerPixel = 0.008F;  // rad
constexpr float kZoomPerNotch = 1.12F;

const char* state_in_words(Timeline::State state, bool live) {
  switch (state) {
    case Timeline::State::following:
      return live ? "live" : "at the end";
    case Timeline::State::playing:
      return "playing";
    case Timeline::State::paused:
      return "paused";
  }
  return "";
}

}  // namespace

ExploreView::ExploreView(ExploreSettings settings, TouchSource& source)
    : settings_(std::move(settings)),
      source_(source),
      renderer_(SceneRenderer::live_quality()),
      labels_(settings_.looks.labels),
      touched_object_(static_cast<int>(settings_.objects.size())) {
  settings_.looks.thickness = kWindowThickness;
  if (settings_.mouse != nullptr) control_.emplace(*settings_.mouse, settings_.workspace);
  if (!source.live()) {
    take_moments(0);
    timeline_.play();
  }
}

void ExploreView::take_moments(double seconds) {
  fresh_.clear();
  source_.take(fresh_);
  for (SceneMoment& moment : fresh_) timeline_.add(std::move(moment));
  timeline_.advance(seconds);
}

// What is not seen must not be felt: while another moment than the newest is shown, forces are off.
void ExploreView::pause_or_go_on() {
  const bool paused = timeline_.state() != Timeline::State::paused;
  if (paused) {
    timeline_.pause();
  } else if (source_.live()) {
    timeline_.follow();
  } else {
    timeline_.play();
  }
  source_.hold(timeline_.state() != Timeline::State::following);
}

void ExploreView::step(int moments) {
  timeline_.step(moments);
  source_.hold(true);
}

ScenePicture ExploreView::picture(const SceneMoment* moment) const {
  SceneDrawingSettings looks = settings_.looks;
  looks.labels = labels_;
  const SceneMoment none;
  ScenePicture out = settings_.drawing.picture(moment != nullptr ? *moment : none,
                                               dark_ ? dark_theme() : light_theme(), looks);
  if (moment == nullptr) {
    out.rods.clear();
    out.balls.clear();
  }
  out.caption.clear();  // the panels say it
  if (cut_axis_ > 0) {
    glm::vec4 plane(0);
    plane[cut_axis_ - 1] = -1;
    plane.w = out.middle[cut_axis_ - 1] + cut_at_ * out.size;
    out.cut = plane;
  }
  return out;
}

void ExploreView::keep_picture() {
  if (!settings_.keep_picture) return;
  constexpr int kWide = 1280, kHigh = 720;
  Camera camera = camera_;
  camera.resize(kWide, kHigh);
  renderer_.draw(picture(timeline_.shown()), camera, dark_ ? dark_theme() : light_theme(), kWide,
                 kHigh);
  note_ = settings_.keep_picture(png_of(renderer_.pixels(), kWide, kHigh), ".png");
}

void ExploreView::keep_clip() {
  if (!settings_.keep_picture || clip_ != nullptr || timeline_.empty()) return;
  clip_ = std::make_unique<ExploreClip>(timeline_, camera_);
}

void ExploreView::continue_clip() {
  if (clip_ == nullptr) return;
  const auto draw = [this](const SceneMoment& moment) { return picture(&moment); };
  const std::optional<std::string> clip =
      clip_->go_on(timeline_, draw, dark_ ? dark_theme() : light_theme());
  if (!clip) return;
  clip_.reset();
  note_ = settings_.keep_picture(*clip, ".webp");
}

void ExploreView::draw(double seconds, const Modifiers& modifiers) {
  take_moments(seconds);
  continue_clip();
  const ImGuiViewport* const all = ImGui::GetMainViewport();
  emergency_bottom_ = draw_emergency(emergency_highlit_);
  ImGui::SetNextWindowPos({all->WorkPos.x, all->WorkPos.y + emergency_bottom_});
  ImGui::SetNextWindowSize({all->WorkSize.x, std::max(all->WorkSize.y - emergency_bottom_, 1.0F)});
  ImGui::Begin("scene", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus);
  const float font = ImGui::GetFontSize(), gap = ImGui::GetStyle().ItemSpacing.x;
  const ImVec2 room = ImGui::GetContentRegionAvail();
  const float side = std::clamp(0.28F * room.x, 15 * font, 24 * font);
  const float left = std::max(room.x - side - gap, 40.0F);
  const float below = 11 * font;
  ImGui::BeginChild("picture", {left, 0}, false, ImGuiWindowFlags_NoScrollbar);
  draw_scene(modifiers, left, std::max(room.y - below, 40.0F));
  draw_time(left);
  draw_plot(left, std::max(ImGui::GetContentRegionAvail().y, 2 * font));
  ImGui::EndChild();
  ImGui::SameLine();
  ImGui::BeginChild("side", {0, 0});
  draw_side();
  ImGui::EndChild();
  ImGui::End();
}

void ExploreView::draw_scene(const Modifiers& modifiers, float width, float height) {
  camera_.resize(width, height);
  const SceneMoment* const shown = timeline_.shown();
  if (!fitted_ && (shown != nullptr || source_.live())) {
    std::vector<glm::vec3> points = settings_.drawing.outline();
    if (!source_.live()) {
      for (const SceneMoment& moment : timeline_.moments())
        if (!moment.contacts.empty())
          settings_.drawing.add_outline(moment, settings_.looks, points);
    }
    camera_.fit(points);
    if (source_.live()) camera_.zoom(0.6F);  // room for a hand
    fitted_ = true;
  }
  const ImVec2 at = ImGui::GetCursorScreenPos(), scale = ImGui::GetIO().DisplayFramebufferScale;
  const unsigned texture =
      renderer_.draw(picture(timeline_.shown()), camera_, dark_ ? dark_theme() : light_theme(),
                     static_cast<int>(width * scale.x), static_cast<int>(height * scale.y));
  // OpenGL textures have their origin at the lower left.
  // NOLINTNEXTLINE(performance-no-int-to-ptr): the identity that the OpenGL back end asks for
  const auto image = reinterpret_cast<ImTextureID>(std::uintptr_t{texture});
  ImGui::GetWindowDrawList()->AddImageRounded(image, at, {at.x + width, at.y + height}, {0, 1},
                                              {1, 0}, IM_COL32_WHITE, 6);
  ImGui::InvisibleButton("scene", {width, height},
                         ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight |
                             ImGuiButtonFlags_MouseButtonMiddle);
  steer(modifiers, at.x, at.y);
  const float font = ImGui::GetFontSize();
  const char* const hint = control_ && timeline_.state() == Timeline::State::following
                               ? (shown != nullptr && !shown->poses.empty()
                                      ? "pointer: the tip    wheel: press    left: turn    Shift "
                                        "and left: pull an object    "
                                        "right: look"
                                      : "pointer: the tip    wheel: press harder    left: turn    "
                                        "right: look    middle: "
                                        "move")
                               : "drag: look    middle or Shift: move    wheel: nearer";
  ImGui::GetWindowDrawList()->AddText({at.x + 0.8F * font, at.y + height - 1.6F * font},
                                      IM_COL32(150, 158, 168, 255), hint);
}

/// Shift and the left button draw an object that moves, at the place under the pointer, in the
/// plane of the picture. \return whether one is drawn
bool ExploreView::pull(const Modifiers& modifiers, const glm::vec2& at, bool left) {
  const SceneMoment* const shown = timeline_.shown();
  const bool wanted = left && modifiers.shift && shown != nullptr && source_.live() &&
                      timeline_.state() == Timeline::State::following;
  if (!wanted || shown->poses.empty()) {
    if (pull_.object >= 0) source_.pull(pull_ = {});
    return false;
  }
  if (pull_.object < 0) {
    const glm::vec3 eye = camera_.eye();
    const auto hit = settings_.drawing.hit(
        eye, glm::normalize(camera_.unproject(at, camera_.centre()) - eye), shown->poses);
    if (!hit || !settings_.objects[hit->object].body) return false;
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
  const bool touches = control_ && timeline_.state() == Timeline::State::following;
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

void ExploreView::draw_side() {
  draw_state();
  ImGui::Dummy({0, 4});
  draw_values();
  ImGui::Dummy({0, 4});
  draw_looks();
  ImGui::Dummy({0, 4});
  draw_material();
  const std::string trouble = source_.trouble();
  if (!trouble.empty()) wrapped_text(console_colour::kBad, trouble);
  if (!note_.empty()) wrapped_text(console_colour::kQuiet, note_);
}

void ExploreView::draw_state() {
  const SceneMoment* const newest = timeline_.empty() ? nullptr : &timeline_.moments().back();
  const bool off = newest != nullptr &&
                   (newest->sample.faults & (servo_fault::kTripped | servo_fault::kEmergency)) != 0;
  coloured_text(console_colour::kQuiet, settings_.title);
  if (off) {
    coloured_text(console_colour::kBad, "Forces are off");
    if (wide_button("Allow forces again", ImGui::GetContentRegionAvail().x, Look::due))
      source_.clear_fault();
  } else {
    coloured_text(console_colour::kGood, state_in_words(timeline_.state(), source_.live()));
  }
}

}  // namespace palpate::runner
