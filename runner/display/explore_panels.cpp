// The panels of ExploreView: time line, values, looks, material.

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "runner/display/console_widgets.h"
#include "runner/display/explore_view.h"
#include "runner/safety/fault_table.h"

namespace palpate::runner {
namespace {

constexpr float kSliderWords = 10;  // widths of a letter, for name and value beside a slider

double force_of(const SceneMoment& moment) {
  const double force = glm::length(moment.sample.device1 + moment.sample.device2);
  return std::isfinite(force) ? force : 0;
}

/// The objects that a choice means: one, or behind the last all of them; compounds with their
/// parts.
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

}  // namespace

void ExploreView::draw_time(float width) {
  const float font = ImGui::GetFontSize(), gap = ImGui::GetStyle().ItemSpacing.x;
  const bool paused = timeline_.state() == Timeline::State::paused;
  const auto button = [&](const char* words, float wide, Look look = Look::plain) {
    const bool pressed = wide_button(words, wide * font, look);
    ImGui::SameLine();
    return pressed;
  };
  if (button(paused ? "Go on" : "Pause", 5.5F, paused ? Look::lit : Look::plain)) pause_or_go_on();
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
  // The largest and smallest of each column of pixels.
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
    if ((moment.sample.faults & ~servo_fault::kForceLimited) != 0 && column != marked) {
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
                            fixed_point(span, 1) + " s; click: that moment";
  list.AddText({at.x + 0.6F * font, at.y + 0.3F * font}, IM_COL32(153, 163, 176, 255),
               words.c_str());
}

void ExploreView::draw_values() {
  if (!ImGui::BeginTable("values", 2)) return;
  const SceneMoment* const moment = timeline_.shown();
  const Sample sample = moment != nullptr ? moment->sample : Sample();
  const rendering::Rendering& r = sample.rendering;
  table_row("Time", fixed_point(timeline_.now() - timeline_.first(), 3) + " s");
  table_row("Force", moment == nullptr ? "-" : fixed_point(force_of(*moment), 3) + " N");
  table_row("Torque", moment == nullptr
                          ? "-"
                          : fixed_point(1000 * glm::length(torque_on_hand(*moment)), 1) + " mN m");
  const auto [force_scale, torque_scale] = settings_.drawing.scale_words(settings_.looks);
  table_row("Arrows", force_scale);
  table_row("Turns", torque_scale);
  table_row("Faults", sample.faults == 0 ? "none" : fault_words(sample.faults),
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
  // Standard views: what they look at and how large stays as it is.
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
  // A scene is compiled anew for each: not while the slider moves.
  if (!done) return;
  source_.show(settings_.objects);
  if (!source_.live()) {
    const double now = timeline_.now();
    timeline_.clear();
    take_moments(0);
    timeline_.seek(now);
  }
}

}  // namespace palpate::runner
