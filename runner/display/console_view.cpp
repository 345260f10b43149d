#include "runner/display/console_view.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <utility>

#include "runner/display/console_words.h"

namespace palpate::runner::display {
namespace {

using namespace console_colour;

constexpr double kForceSpan = 10;  // s, shown in the plot
constexpr double kSilence = 1;     // s; a longer silence is reported

}  // namespace

// The user of the mouse device must see the scene.
ConsoleView::ConsoleView(const WindowSettings& settings, bool shared)
    : shared_(shared && settings.mouse == nullptr), hidden_(shared_) {
  if (settings.mouse != nullptr) control_.emplace(*settings.mouse, settings.workspace);
}

void ConsoleView::share(bool shared) {
  shared = shared && !control_;
  if (shared != shared_) hidden_ = shared;
  shared_ = shared;
}

void ConsoleView::update(ConsoleState state, double now) {
  state_ = std::move(state);
  updated_at_ = now;
  has_state_ = true;
  const double time = static_cast<double>(state_.sample.time_ns) * 1e-9;
  const double force = glm::length(state_.sample.device1 + state_.sample.device2);
  if (!forces_.empty() && time < forces_.back().time) forces_.clear();
  if (!forces_.empty() && time == forces_.back().time) forces_.pop_back();
  forces_.push_back({time, std::isfinite(force) ? force : 0});
  while (forces_.front().time < time - kForceSpan) forces_.pop_front();
}

std::vector<ConsoleCommand> ConsoleView::draw(double now, const Modifiers& modifiers) {
  std::vector<ConsoleCommand> commands;
  const ImGuiViewport* const all = ImGui::GetMainViewport();
  emergency_bottom_ = draw_emergency(emergency_highlit_);
  ImGui::SetNextWindowPos({all->WorkPos.x, all->WorkPos.y + emergency_bottom_});
  ImGui::SetNextWindowSize({all->WorkSize.x, std::max(all->WorkSize.y - emergency_bottom_, 1.0F)});
  ImGui::Begin("console", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus);
  const float font = ImGui::GetFontSize();
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const ImVec2 room = ImGui::GetContentRegionAvail();
  const bool narrow = room.x < 44 * font;
  const float side = std::clamp(0.36F * room.x, 22 * font, 30 * font);
  const bool checks = !state_.checklist.steps.empty();
  const float least = (checks || !hidden_ ? 7.5F : 6.5F) * font;
  const float high = std::clamp(room.y - controls_ - min_notes_height() - gap, least,
                                std::max(least, (checks ? 0.6F : 0.45F) * room.y));
  ImGui::BeginChild("picture", narrow ? ImVec2{0, high} : ImVec2{room.x - side - gap, 0}, false,
                    ImGuiWindowFlags_NoScrollbar);
  draw_picture(modifiers, !narrow, commands);
  ImGui::EndChild();
  if (!narrow) ImGui::SameLine();
  ImGui::BeginChild("side", {0, 0}, false, ImGuiWindowFlags_NoScrollbar);
  draw_side(now, narrow, commands);
  ImGui::EndChild();
  ImGui::End();
  return commands;
}

void ConsoleView::draw_picture(const Modifiers& modifiers, bool with_plots,
                               std::vector<ConsoleCommand>& commands) {
  const float font = ImGui::GetFontSize();
  const ImVec2 spacing = ImGui::GetStyle().ItemSpacing;
  const ImVec2 room = ImGui::GetContentRegionAvail();
  const float plots = with_plots ? std::clamp(0.22F * room.y, 6 * font, 12 * font) : 0;
  const float width = std::max(room.x, 40.0F);
  const float readings =
      readings_are_in_picture(with_plots) ? health_height(state_) + spacing.y : 0;
  const float height = std::max(room.y - readings - (with_plots ? plots + spacing.y : 0), 40.0F);
  if (!state_.checklist.steps.empty()) {
    ImGui::BeginChild("checklist", {width, height});
    draw_checklist(state_.checklist, end_request_, commands);
    ImGui::EndChild();
  } else if (hidden_) {
    draw_hidden(width, height);
  } else {
    draw_view(modifiers, width, height);
  }
  if (readings > 0) draw_health(state_, false);
  if (!with_plots) return;
  const float plots_beside = hidden_ ? 2 : 3;
  const float part = (room.x - spacing.x * (plots_beside - 1)) / plots_beside;
  draw_forces(forces_, part, plots);
  ImGui::SameLine();
  draw_times(state_.times, part, plots);
  if (hidden_) return;
  ImGui::SameLine();
  draw_scores(state_, part, plots);
}

void ConsoleView::draw_hidden(float width, float height) {
  const float font = ImGui::GetFontSize();
  ImGui::PushStyleColor(ImGuiCol_ChildBg, ImGui::GetStyleColorVec4(ImGuiCol_FrameBg));
  ImGui::BeginChild("hidden", {width, height}, false, ImGuiWindowFlags_AlwaysUseWindowPadding);
  ImGui::Dummy({0, std::max(0.0F, height / 2 - 6 * font)});
  ImGui::PushTextWrapPos(0);
  ImGui::TextUnformatted(
      "One monitor: shape, scene and whether answers are correct are hidden here, because the "
      "participant may see this window.");
  ImGui::PopTextWrapPos();
  if (ImGui::Button("Show them", {10 * font, 2 * font})) hidden_ = false;
  ImGui::EndChild();
  ImGui::PopStyleColor();
}

void ConsoleView::draw_view(const Modifiers& modifiers, float width, float height) {
  const float font = ImGui::GetFontSize();
  camera_.resize(width, height);
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const ImVec2 scale = ImGui::GetIO().DisplayFramebufferScale;
  const unsigned texture =
      scene_.draw(state_.objects, state_.tool, state_.sample, state_.bodies, camera_,
                  static_cast<int>(width * scale.x), static_cast<int>(height * scale.y));
  // OpenGL textures have their origin at the lower left.
  // NOLINTNEXTLINE(performance-no-int-to-ptr): the identity that the OpenGL back end asks for
  const auto picture = reinterpret_cast<ImTextureID>(std::uintptr_t{texture});
  ImGui::GetWindowDrawList()->AddImageRounded(picture, at, {at.x + width, at.y + height}, {0, 1},
                                              {1, 0}, IM_COL32_WHITE, 6);
  ImGui::InvisibleButton("view", {width, height},
                         ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
  ImGui::SetItemAllowOverlap();  // so that the button drawn over it works
  const ImGuiIO& io = ImGui::GetIO();
  PointerMotion pointer;
  pointer.over = ImGui::IsItemHovered() || ImGui::IsItemActive();
  pointer.at = {io.MousePos.x - at.x, io.MousePos.y - at.y};
  pointer.moved = {io.MouseDelta.x, io.MouseDelta.y};
  pointer.wheel = ImGui::IsItemHovered() ? io.MouseWheel : 0;
  pointer.orbit =
      ImGui::IsItemActive() && (ImGui::IsMouseDown(ImGuiMouseButton_Right) ||
                                (!control_ && ImGui::IsMouseDown(ImGuiMouseButton_Left)));
  pointer.turn =
      modifiers.ctrl || (ImGui::IsItemActive() && ImGui::IsMouseDown(ImGuiMouseButton_Left));
  pointer.depth = modifiers.shift;
  if (pointer.orbit) camera_.orbit(-0.008F * pointer.moved.x, 0.008F * pointer.moved.y);
  if (control_) {
    control_->step(pointer, camera_, [this](const glm::vec3& from, const glm::vec3& along) {
      return scene_.hit(from, along);
    });
  }

  const auto label = [&](float line, const std::string& words, ImU32 colour) {
    ImGui::GetWindowDrawList()->AddText({at.x + 0.8F * font, at.y + (0.6F + 1.4F * line) * font},
                                        colour, words.c_str());
  };
  if (!scene_.trouble().empty()) label(0, scene_.trouble(), IM_COL32(247, 117, 102, 255));
  const float last = (height / font - 2.1F) / 1.4F;
  const ImU32 quiet = IM_COL32(150, 158, 168, 255);
  if (control_) {
    const float wide = width - 1.6F * font;
    label(last - 1,
          fitting({"pointer: the tip, on what is under it     wheel or Shift: press harder",
                   "pointer: the tip     wheel or Shift: press harder", "wheel or Shift: press"},
                  wide),
          quiet);
    label(last,
          fitting({"Ctrl or left button: turn     right button: look around", "Ctrl: turn"}, wide),
          quiet);
  } else {
    label(last, "drag: look around", quiet);
  }
  if (!shared_) return;
  ImGui::SetCursorScreenPos({at.x + width - 7 * font, at.y + 0.6F * font});
  if (ImGui::Button("Hide", {6.4F * font, 2 * font})) hidden_ = true;
  ImGui::SetCursorScreenPos({at.x, at.y + height + ImGui::GetStyle().ItemSpacing.y});
}

float ConsoleView::min_notes_height() {
  return 5.5F * ImGui::GetFontSize() + ImGui::GetFrameHeightWithSpacing() +
         ImGui::GetStyle().ItemSpacing.y;
}

// The readings of the servo stand below the picture, where all buttons stay in sight beside them;
// in a low or narrow window they follow the buttons.
bool ConsoleView::readings_are_in_picture(bool wide) {
  constexpr float kLeastLines = 36;
  return wide && ImGui::GetMainViewport()->WorkSize.y > kLeastLines * ImGui::GetFontSize();
}

// In a small window the controls scroll; the newest message stays visible.
void ConsoleView::draw_side(double now, bool narrow, std::vector<ConsoleCommand>& commands) {
  const float room = ImGui::GetContentRegionAvail().y;
  const float notes = std::max(min_notes_height(), room - controls_);
  ImGui::BeginChild("controls", {0, std::max(room - notes, 1.0F)});
  draw_forces_off(state_, has_state_ && now - updated_at_ > kSilence ? now - updated_at_ : 0,
                  commands);
  draw_status(state_, hidden_, narrow);
  draw_buttons(state_, narrow, end_request_, correction_, commands);
  const bool crowded =
      narrow && (end_request_.open || correction_.open || !state_.checklist.steps.empty());
  if (!crowded && !readings_are_in_picture(!narrow)) draw_health(state_, narrow);
  ImGui::Dummy({0, 2});
  controls_ = ImGui::GetCursorPosY();
  ImGui::EndChild();
  draw_notes(commands);
}

void ConsoleView::draw_answer(std::vector<ConsoleCommand>& commands) {
  if (!state_.takes_answers) return;
  ImGui::SetNextItemWidth(-1);
  if (!ImGui::InputTextWithHint("##answer", "The answer that was spoken; Enter", answer_.data(),
                                answer_.size(), ImGuiInputTextFlags_EnterReturnsTrue))
    return;
  commands.push_back({ConsoleCommand::Kind::answer, answer_.data(), 0});
  answer_.fill(0);
  ImGui::SetKeyboardFocusHere(-1);  // for the next one
}

void ConsoleView::draw_notes(std::vector<ConsoleCommand>& commands) {
  const float field = (state_.takes_answers ? 2.0F : 1.0F) * ImGui::GetFrameHeightWithSpacing();
  const float room = std::max(ImGui::GetContentRegionAvail().y - field, ImGui::GetFontSize());
  ImGui::PushStyleColor(ImGuiCol_ChildBg, ImGui::GetStyleColorVec4(ImGuiCol_FrameBg));
  ImGui::BeginChild(
      "messages", {0, room}, false,
      ImGuiWindowFlags_AlwaysUseWindowPadding | ImGuiWindowFlags_AlwaysVerticalScrollbar);
  ImGui::PushTextWrapPos(0);
  for (const std::string& message : state_.messages) {
    const bool newest = &message == &state_.messages.back();
    ImGui::PushStyleColor(ImGuiCol_Text,
                          ImGui::GetStyleColorVec4(newest ? ImGuiCol_Text : ImGuiCol_TextDisabled));
    ImGui::TextUnformatted(message.c_str(), message.c_str() + message.size());
    ImGui::PopStyleColor();
  }
  ImGui::PopTextWrapPos();
  // The full height is known only a frame after the message was first drawn.
  const std::size_t count = state_.older_messages + state_.messages.size();
  if (count != messages_seen_) frames_to_scroll_ = 3;
  messages_seen_ = count;
  if (frames_to_scroll_ > 0) {
    ImGui::SetScrollY(ImGui::GetScrollMaxY());
    --frames_to_scroll_;
  }
  ImGui::EndChild();
  ImGui::PopStyleColor();
  draw_answer(commands);
  ImGui::SetNextItemWidth(-1);
  if (ImGui::InputTextWithHint("##note", "A note, stored with its time; Enter", note_.data(),
                               note_.size(), ImGuiInputTextFlags_EnterReturnsTrue)) {
    if (note_[0] != 0) commands.push_back({ConsoleCommand::Kind::note, note_.data(), 0});
    note_.fill(0);
  }
}

}  // namespace palpate::runner::display
