#include "runner/display/explore_view.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <iostream>
#include <iterator>
#include <utility>

#include "runner/display/console_elements.h"
#include "runner/display/fonts.h"
#include "runner/display/scene/image_file.h"
#include "runner/safety/fault_signals.h"
#include "runner/servo/sample.h"

namespace palpate::runner::display {
namespace {

constexpr float kOrbitPerPixel = 0.008F;  // rad
constexpr float kZoomPerNotch = 1.12F;
constexpr ImU32 kFaintInk = IM_COL32(150, 158, 168, 255);

constexpr float kSliderWords = 10;  // widths of a letter, for name and value beside a slider

double force_of(const SceneMoment& moment) {
  const double force = glm::length(moment.sample.device1 + moment.sample.device2);
  return std::isfinite(force) ? force : 0;
}

/// Calls `change` for the materials of the chosen object and its parts, or, for an index past the
/// last, of all objects.
void for_each_chosen(std::vector<stimuli::ObjectSpec>& objects, int chosen,
                     const std::function<void(stimuli::Material&)>& change) {
  const std::function<void(stimuli::ObjectSpec&)> visit = [&](stimuli::ObjectSpec& object) {
    change(object.material);
    for (stimuli::ObjectSpec& part : object.parts) visit(part);
  };
  for (std::size_t i = 0; i < objects.size(); ++i)
    if (chosen == static_cast<int>(i) || chosen == static_cast<int>(objects.size()))
      visit(objects[i]);
}

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

/// A clip of the last seconds of a window. A few pictures are drawn in each frame, so the window
/// stays responsive. Needs the current OpenGL context of the window.
class ExploreClip {
 public:
  static constexpr double kSpan = 5;              ///< s, of the path
  static constexpr double kEvery = 0.04;          ///< s, between pictures
  static constexpr int kWide = 640, kHigh = 360;  ///< px

  /// Copies the last kSpan before the moment shown (if that is the first one, from there on),
  /// because the timeline drops old moments while the clip is drawn. \param timeline  not empty
  ExploreClip(const Timeline& timeline, const Camera& camera);

  using Draw = std::function<ScenePicture(const SceneMoment&)>;
  /// Draws the next picture. \return whether it was the last
  bool draw_next(const Draw& draw, const Theme& theme);
  double done() const;  ///< 0 to 1
  /// The animated WebP of the pictures drawn; call it last. Empty: none were drawn.
  std::string finish();

 private:
  SceneRenderer renderer_;
  WebpAnimation animation_;
  Camera camera_;
  std::vector<SceneMoment> moments_;  ///< kEvery apart
  std::size_t drawn_ = 0;
};

ExploreClip::ExploreClip(const Timeline& timeline, const Camera& camera)
    : renderer_(SceneRenderer::live_quality()), animation_(kWide, kHigh), camera_(camera) {
  camera_.resize(kWide, kHigh);
  const double from = std::max(timeline.first(), timeline.now() - kSpan);
  const double to =
      timeline.now() > timeline.first() ? timeline.now() : std::min(timeline.last(), from + kSpan);
  const auto& all = timeline.moments();
  for (int i = 0; from + i * kEvery <= to; ++i) {
    const auto after = std::ranges::upper_bound(all, from + i * kEvery, {}, time_of);
    moments_.push_back(after != all.begin() ? *std::prev(after) : all.front());
  }
}

bool ExploreClip::draw_next(const Draw& draw, const Theme& theme) {
  if (drawn_ < moments_.size()) {
    renderer_.draw(draw(moments_[drawn_]), camera_, theme, kWide, kHigh);
    animation_.add(renderer_.pixels(), static_cast<double>(drawn_) * kEvery);
    ++drawn_;
  }
  return drawn_ == moments_.size();
}

double ExploreClip::done() const {
  return moments_.empty() ? 1 : static_cast<double>(drawn_) / static_cast<double>(moments_.size());
}

std::string ExploreClip::finish() {
  return drawn_ > 0 ? animation_.finish(static_cast<double>(drawn_) * kEvery) : std::string();
}

std::string ExploreView::hint() const {
  if (!not_pulled_.empty()) return not_pulled_;
  if (const double away = source_.away(); away > 0)
    return "Resumes once the stylus is back where it was: " +
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
  // Projected at the point that the camera looks at.
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
  ImGui::GetWindowDrawList()->AddText({x + 0.8F * font, y + height - 1.6F * font}, kFaintInk,
                                      hint().c_str());
}

/// Shift and the left button pull an object that moves, at the place under the pointer, in the
/// plane of the picture. \return whether one is pulled, or the user tries to pull one that cannot
/// move
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
                    (object.soft ? " is soft: press it with the stylus; only objects with "
                                   "\"body\" can be pulled"
                                 : " is fixed: only objects with \"body\" can be pulled");
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

void ExploreView::draw_time(float width) {
  const float font = ImGui::GetFontSize(), gap = ImGui::GetStyle().ItemSpacing.x;
  const bool paused = timeline_.state() == Timeline::State::paused;
  const auto button = [&](const char* words, float wide, Look look = Look::plain) {
    const bool pressed = wide_button(words, wide * font, look);
    ImGui::SameLine();
    return pressed;
  };
  if (button(paused ? "Go on" : "Pause", 5.5F, paused ? Look::lit : Look::plain)) pause_or_resume();
  if (button("< tick", 4)) step(-1);
  if (button("tick >", 4)) step(1);
  if (button("Play", 4)) {
    steps_ = false;
    timeline_.play();
    source_.hold(true);
  }
  if (source_.live() && button("Live", 4)) {
    steps_ = false;
    timeline_.follow();
    source_.hold(false);
  }
  auto speed = static_cast<float>(timeline_.speed());
  ImGui::SetNextItemWidth(std::clamp(width - 35 * font - 6 * gap, 5 * font, 12 * font));
  if (slider("speed", speed, {0.01F, 2, 2, " x"})) timeline_.set_speed(speed);
}

void ExploreView::draw_plot(float width, float height) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float font = ImGui::GetFontSize();
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddRectFilled(at, {at.x + width, at.y + height}, ImGui::GetColorU32(ImGuiCol_FrameBg), 6);
  ImGui::InvisibleButton("time", {std::max(width, 1.0F), std::max(height, 1.0F)});
  const float from = at.x + font, to = at.x + width - font;
  const float low = at.y + height - 0.6F * font, high = at.y + 1.8F * font;
  const double first = timeline_.first(), span = std::max(timeline_.last() - first, 1e-3);
  if (ImGui::IsItemActive() && to > from) {
    steps_ = false;
    timeline_.seek(first +
                   span * static_cast<double>((ImGui::GetIO().MousePos.x - from) / (to - from)));
    source_.hold(true);
  }
  double most = 0.1;
  for (const SceneMoment& moment : timeline_.moments()) most = std::max(most, force_of(moment));
  // Draw the largest and smallest value of each column of pixels.
  const auto columns = static_cast<std::size_t>(std::max(to - from, 1.0F));
  std::vector<ImVec2> line;
  double least_here = 0, most_here = 0;
  std::size_t here = columns;
  const auto place = [&](std::size_t column, double force) {
    line.emplace_back(from + static_cast<float>(column),
                      low - static_cast<float>(force / most) * (low - high));
  };
  const auto flush = [&] {
    if (here == columns) return;
    place(here, least_here);
    place(here, most_here);
  };
  std::size_t marked = columns;
  for (const SceneMoment& moment : timeline_.moments()) {
    const auto column = std::min(
        columns - 1,
        static_cast<std::size_t>(static_cast<double>(columns) * (time_of(moment) - first) / span));
    const double force = force_of(moment);
    if ((moment.sample.faults & ~servo::servo_fault::kForceLimited) != 0 && column != marked) {
      marked = column;
      const float at_x = from + static_cast<float>(column);
      list.AddLine({at_x, low}, {at_x, low + 0.4F * font}, IM_COL32(247, 117, 102, 255), 2);
    }
    if (column != here) {
      flush();
      here = column;
      least_here = most_here = force;
    }
    least_here = std::min(least_here, force);
    most_here = std::max(most_here, force);
  }
  flush();
  if (line.size() > 1)
    list.AddPolyline(line.data(), static_cast<int>(line.size()), IM_COL32(247, 199, 66, 255), 0,
                     1.5F);
  const auto cursor = from + static_cast<float>((timeline_.now() - first) / span) * (to - from);
  list.AddLine({cursor, at.y + 0.3F * font}, {cursor, at.y + height - 0.3F * font},
               IM_COL32(240, 240, 240, 200), 1.5F);
  const std::string words = "Force on the hand, up to " + fixed_point(most, 2) + " N; " +
                            fixed_point(span, 1) + " s; click: show that moment";
  list.AddText({at.x + 0.6F * font, at.y + 0.3F * font}, IM_COL32(153, 163, 176, 255),
               words.c_str());
}

void ExploreView::draw_values() {
  if (!ImGui::BeginTable("values", 2)) return;
  const SceneMoment* const moment = timeline_.shown();
  const servo::Sample sample = moment != nullptr ? moment->sample : servo::Sample();
  const rendering::Rendering& r = sample.rendering;
  table_row("Time", fixed_point(timeline_.now() - timeline_.first(), 3) + " s");
  table_row("Force", moment == nullptr ? "-" : fixed_point(force_of(*moment), 3) + " N");
  table_row("Torque", moment == nullptr
                          ? "-"
                          : fixed_point(1000 * glm::length(torque_on_hand(*moment)), 1) + " mN m");
  const auto [force_scale, torque_scale] = settings_.drawing.scale_words(settings_.looks);
  table_row("Arrows", force_scale);
  table_row("Turns", torque_scale);
  table_row("Faults", sample.faults == 0 ? "none" : safety::fault_words(sample.faults),
            sample.faults == 0 ? console_colour::kBright : console_colour::kBad);
  table_row("Contacts", std::to_string(r.contacts));
  table_row("Depth", fixed_point(1000 * r.deepest.depth, 3) + " mm");
  table_row("Kind", rendering::to_string(r.deepest.type));
  const bool known =
      r.object >= 0 && static_cast<std::size_t>(r.object) < settings_.drawing.objects();
  table_row("Object", known ? settings_.drawing.label(static_cast<std::size_t>(r.object)) : "none");
  table_row("Pointer on", under_pointer_.empty() ? "nothing" : under_pointer_);
  ImGui::EndTable();
}

void ExploreView::draw_looks() {
  ImGui::Checkbox("Labels", &labels_);
  ImGui::SameLine();
  ImGui::Checkbox("Dark", &dark_);
  ImGui::SameLine();
  if (ImGui::Button("Fit")) fitted_ = false;
  // Standard views change the direction only, not centre and scale.
  struct View {
    const char* name;
    float yaw, pitch;
  };
  constexpr float kQuarter = static_cast<float>(M_PI) / 2;
  for (const View& view : {View{"Front", 0, 0}, {"Right", kQuarter, 0}, {"Above", 0, kQuarter}}) {
    if (ImGui::Button(view.name)) camera_.look_from(view.yaw, view.pitch);
    ImGui::SameLine();
  }
  ImGui::NewLine();
  ImGui::SetNextItemWidth(0.4F * ImGui::GetContentRegionAvail().x);
  ImGui::Combo("cut across", &cut_axis_, "nothing\0x\0y\0z\0");
  ImGui::SetNextItemWidth(-kSliderWords * ImGui::GetFontSize());
  if (cut_axis_ > 0) slider("at", cut_at_, {-1, 1, 2, " of the size"});
  if (!settings_.keep_picture) return;
  if (wide_button("Keep this picture", ImGui::GetContentRegionAvail().x)) keep_picture();
  if (clip_ != nullptr) {
    ImGui::ProgressBar(static_cast<float>(clip_->done()), {-1, 0}, "drawing the clip");
  } else if (wide_button("Keep the last 5 s as a clip", ImGui::GetContentRegionAvail().x)) {
    keep_clip();
  }
}

void ExploreView::draw_material() {
  const int all = static_cast<int>(settings_.objects.size());
  const auto name = [&](int i) {
    return i == all ? std::string("all objects")
                    : settings_.drawing.label(static_cast<std::size_t>(i));
  };
  coloured_text(console_colour::kQuiet, "Material");
  if (ImGui::BeginCombo("of", name(touched_object_).c_str())) {
    for (int i = 0; i <= all; ++i)
      if (ImGui::Selectable(name(i).c_str(), i == touched_object_)) touched_object_ = i;
    ImGui::EndCombo();
  }
  if (settings_.objects.empty()) return;
  const stimuli::ObjectSpec& example =
      settings_.objects[static_cast<std::size_t>(touched_object_ == all ? 0 : touched_object_)];
  auto stiffness = static_cast<float>(example.material.stiffness);
  auto damping = static_cast<float>(example.material.damping);
  auto friction = static_cast<float>(example.material.friction_static);
  bool done = false;
  const auto setting = [&](const char* word, float& value, const SliderRange& range,
                           const std::function<void(stimuli::Material&)>& change) {
    ImGui::SetNextItemWidth(-kSliderWords * ImGui::GetFontSize());
    if (slider(word, value, range)) for_each_chosen(settings_.objects, touched_object_, change);
    done |= ImGui::IsItemDeactivatedAfterEdit();
  };
  setting("stiffness", stiffness, {10, 5000, 0, " N/m"},
          [&](stimuli::Material& m) { m.stiffness = std::clamp(stiffness, 0.0F, 1e5F); });
  setting("damping", damping, {0, 10, 2, " N s/m"},
          [&](stimuli::Material& m) { m.damping = std::clamp(damping, 0.0F, 1e3F); });
  setting("friction", friction, {0, 1.5F, 2, ""}, [&](stimuli::Material& m) {
    m.friction_static = m.friction_dynamic = std::clamp(friction, 0.0F, 10.0F);
  });
  // Each change compiles the scene anew: wait until the slider is released.
  if (!done) return;
  source_.show(settings_.objects);
  if (!source_.live()) {
    const double now = timeline_.now();
    timeline_.clear();
    take_moments(0);
    timeline_.seek(now);
  }
}

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

ExploreView::~ExploreView() = default;

void ExploreView::take_moments(double seconds) {
  fresh_.clear();
  source_.take(fresh_);
  for (SceneMoment& moment : fresh_) timeline_.add(std::move(moment));
  if (steps_ && !fresh_.empty()) timeline_.seek(timeline_.last());
  // While the scene is held, the stylus stays where it was.
  const bool held = timeline_.state() != Timeline::State::following;
  goes_on_ = !held && (goes_on_ || !fresh_.empty());
  if (control_ && !goes_on_ && !timeline_.empty())
    control_->rest_at(timeline_.moments().back().sample.probe);
  timeline_.advance(seconds);
}

// A participant must not feel a state that is not shown: forces are off unless the newest moment is
// shown.
void ExploreView::pause_or_resume() {
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

/// At the newest moment, a live scene computes further ones.
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
  out.caption.clear();  // the panels show it
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

/// Draws the next picture. \return whether it was the last
bool ExploreView::draw_clip() {
  const auto draw = [this](const SceneMoment& moment) { return picture(&moment); };
  return clip_->draw_next(draw, dark_ ? dark_theme() : light_theme());
}

void ExploreView::end_clip() {
  const std::string clip = clip_->finish();
  clip_.reset();
  note_ = clip.empty() ? "" : settings_.keep_picture(clip, ".webp");
}

/// Draws as many pictures as fit into a frame's time, at least one.
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

std::string ExploreView::finish_clip(const std::function<bool(double)>& continues) {
  if (clip_ == nullptr) return {};
  while (continues(clip_->done()) && !draw_clip()) {
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
  if ((faults & (servo::servo_fault::kTripped | servo::servo_fault::kEmergency)) != 0) {
    wrapped_text(console_colour::kBad, "Forces are off: " + why_off());
    if (wide_button("Allow forces again", ImGui::GetContentRegionAvail().x, Look::due))
      source_.clear_fault();
  } else {
    coloured_text(console_colour::kGood, state_in_words(timeline_.state(), source_.live()));
  }
  const bool behind = timeline_.state() != Timeline::State::following && source_.live() &&
                      timeline_.now() < timeline_.last();
  if (behind)
    wrapped_text(console_colour::kQuiet,
                 "This shows the past. Live resumes from the newest moment, " +
                     fixed_point(timeline_.last() - timeline_.first(), 3) + " s.");
}

/// The faults of the ticks since forces went off.
std::string ExploreView::why_off() const {
  std::uint32_t bits = 0;
  const auto& moments = timeline_.moments();
  for (auto it = moments.rbegin(); it != moments.rend(); ++it) {
    if ((it->sample.faults & servo::servo_fault::kTripped) == 0) break;
    bits |= it->sample.faults & ~servo::servo_fault::kTripped;
  }
  std::string words;
  for (const rendering::FaultBit& fault : safety::kFaultTable) {
    if ((bits & fault.bit) == 0 || fault.why[0] == 0) continue;
    words += (words.empty() ? "" : "; ") + std::string(fault.why);
  }
  return words.empty() ? safety::fault_row(servo::servo_fault::kTripped).why : words;
}

/// Lists all faults of the kept moments: a single tick would be too short to see.
void ExploreView::draw_faults() {
  const std::vector<Timeline::Fault> faults = timeline_.faults();
  if (faults.empty()) return;
  coloured_text(console_colour::kQuiet, "Faults in these ticks; click: show the last");
  for (const Timeline::Fault& fault : faults) {
    const bool ordinary = fault.bit == servo::servo_fault::kForceLimited;
    ImGui::PushStyleColor(ImGuiCol_Text, ordinary ? console_colour::kBright : console_colour::kBad);
    const std::string words = safety::fault_words(fault.bit) + ": " + std::to_string(fault.count) +
                              ", last at " + fixed_point(fault.last - timeline_.first(), 3) + " s";
    if (ImGui::Selectable(words.c_str())) {
      steps_ = false;
      timeline_.seek(fault.last);
      source_.hold(true);
    }
    ImGui::PopStyleColor();
  }
}

}  // namespace palpate::runner::display
