#include "runner/display/explore_view.h"

#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>

#include "runner/display/console_panels.h"
#include "runner/display/console_widgets.h"
#include "runner/display/scene/image_file.h"
#include "runner/safety/fault_table.h"
#include "runner/servo/servo_fault.h"

namespace palpate::runner {
namespace {

constexpr double kWindowThickness = 1.3;  // of the tool

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
  if (steps_ && !fresh_.empty()) timeline_.seek(timeline_.last());
  // Until it goes on, the stylus waits where it was.
  const bool held = timeline_.state() != Timeline::State::following;
  goes_on_ = !held && (goes_on_ || !fresh_.empty());
  if (control_ && !goes_on_ && !timeline_.empty())
    control_->rest_at(timeline_.moments().back().sample.probe);
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
  steps_ = false;
  source_.hold(timeline_.state() != Timeline::State::following);
}

/// Behind the newest moment a live scene makes more of them.
void ExploreView::step(int moments) {
  source_.hold(true);
  const bool at_end = timeline_.now() >= timeline_.last();
  steps_ = source_.live() && moments > 0 && at_end;
  if (steps_) {
    timeline_.pause();
    source_.step(moments);
  } else {
    timeline_.step(moments);
  }
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

/// One picture more of it. \return whether that was the last
bool ExploreView::draw_clip() {
  const auto draw = [this](const SceneMoment& moment) { return picture(&moment); };
  return clip_->go_on(draw, dark_ ? dark_theme() : light_theme());
}

void ExploreView::end_clip() {
  const std::string clip = clip_->finish();
  clip_.reset();
  note_ = clip.empty() ? "" : settings_.keep_picture(clip, ".webp");
}

/// As many pictures as a frame has time for, at least one.
void ExploreView::continue_clip() {
  if (clip_ == nullptr) return;
  constexpr std::chrono::milliseconds kShare(30);
  const auto began = std::chrono::steady_clock::now();
  do {
    if (!draw_clip()) continue;
    end_clip();
    return;
  } while (std::chrono::steady_clock::now() - began < kShare);
}

std::string ExploreView::finish_clip(const std::function<bool(double)>& go_on) {
  if (clip_ == nullptr) return {};
  while (go_on(clip_->done()) && !draw_clip()) {
  }
  end_clip();
  return note_;
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
  draw_over_scene(at.x, at.y, width, height);
}

void ExploreView::draw_side() {
  draw_state();
  ImGui::Dummy({0, 4});
  draw_values();
  draw_faults();
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
  const std::uint32_t faults = newest != nullptr ? newest->sample.faults : 0;
  coloured_text(console_colour::kQuiet, settings_.title);
  if ((faults & (servo_fault::kTripped | servo_fault::kEmergency)) != 0) {
    wrapped_text(console_colour::kBad, "Forces are off: " + why_off());
    if (wide_button("Allow forces again", ImGui::GetContentRegionAvail().x, Look::due))
      source_.clear_fault();
  } else {
    coloured_text(console_colour::kGood, state_in_words(timeline_.state(), source_.live()));
  }
  const bool behind = timeline_.state() != Timeline::State::following && source_.live() &&
                      timeline_.now() < timeline_.last();
  if (behind)
    wrapped_text(console_colour::kQuiet, "Seen is the past. Live goes on from the newest moment, " +
                                             fixed_point(timeline_.last() - timeline_.first(), 3) +
                                             " s.");
}

/// What the ticks had since forces went off.
std::string ExploreView::why_off() const {
  std::uint32_t bits = 0;
  const auto& moments = timeline_.moments();
  for (auto it = moments.rbegin(); it != moments.rend(); ++it) {
    if ((it->sample.faults & servo_fault::kTripped) == 0) break;
    bits |= it->sample.faults & ~servo_fault::kTripped;
  }
  std::string words;
  for (const rendering::FaultBit& fault : kFaultTable) {
    if ((bits & fault.bit) == 0 || fault.why[0] == 0) continue;
    words += (words.empty() ? "" : "; ") + std::string(fault.why);
  }
  return words.empty() ? fault_row(servo_fault::kTripped).why : words;
}

/// Every bit of the moments that are kept: one tick is too short to be seen.
void ExploreView::draw_faults() {
  const std::vector<Timeline::Fault> faults = timeline_.faults();
  if (faults.empty()) return;
  coloured_text(console_colour::kQuiet, "Faults in these ticks; click: the last of them");
  for (const Timeline::Fault& fault : faults) {
    const bool ordinary = fault.bit == servo_fault::kForceLimited;
    ImGui::PushStyleColor(ImGuiCol_Text, ordinary ? console_colour::kBright : console_colour::kBad);
    const std::string words = fault_words(fault.bit) + ": " + std::to_string(fault.count) +
                              ", last at " + fixed_point(fault.last - timeline_.first(), 3) + " s";
    if (ImGui::Selectable(words.c_str())) {
      steps_ = false;
      timeline_.seek(fault.last);
      source_.hold(true);
    }
    ImGui::PopStyleColor();
  }
}

}  // namespace palpate::runner
