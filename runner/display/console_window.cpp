#include "runner/display/console_window.h"

#include <epoxy/gl.h>
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <utility>

#include "runner/display/console_words.h"
#include "runner/display/fonts.h"
#include "runner/display/key_names.h"
#include "runner/display/x11_errors.h"

namespace palpate::runner::display {

ConsoleWindow::ConsoleWindow(const WindowSettings& settings, const WindowLayout& layout,
                             ParticipantWindow& participant)
    : settings_(settings),
      participant_(participant),
      window_(make_window(settings.title + " - console", layout.console)) {
  context_ = begin_imgui(window_, settings.texts, static_cast<float>(layout.console_scale));
  glfwSetWindowUserPointer(window_, this);
  glfwSetKeyCallback(window_, &ConsoleWindow::on_key);
  glfwSetCharCallback(window_, &ConsoleWindow::on_character);
  glfwSetCursorPosCallback(window_, &ConsoleWindow::on_pointer);
  glfwSetMouseButtonCallback(window_, &ConsoleWindow::on_button);
  view_ = std::make_unique<ConsoleView>(settings, layout.shared);
}

ConsoleWindow::~ConsoleWindow() {
  if (window_ == nullptr) {
    // Without a display OpenGL and GLFW must not be called: leak what they hold.
    static_cast<void>(view_.release());
    return;
  }
  destroy();
}

void ConsoleWindow::destroy() {
  glfwMakeContextCurrent(window_);
  view_.reset();
  end_imgui(context_);
  glfwDestroyWindow(window_);
  window_ = nullptr;
}

std::string ConsoleWindow::name_of(ConsoleCommand::Kind kind) const {
  return "'" + std::string(button_label(kind)) + "'";
}

std::string ConsoleWindow::places() const {
  const std::lock_guard lock(places_mutex_);
  return places_;
}

void ConsoleWindow::put_places(std::string note) {
  const std::lock_guard lock(places_mutex_);
  places_ = std::move(note);
}

void ConsoleWindow::send_command(ConsoleCommand::Kind kind, std::string text) {
  const std::int64_t now = settings_.clock->now_ns();
  if (kind == ConsoleCommand::Kind::emergency_zero && settings_.emergency) settings_.emergency();
  commands_.add({kind, std::move(text), now});
}

void ConsoleWindow::on_key(GLFWwindow* window, int key, int scancode, int action, int mods) {
  auto& self = *static_cast<ConsoleWindow*>(glfwGetWindowUserPointer(window));
  const bool typing = ImGui::GetIO().WantTextInput;
  const bool answer = on_keypad(key) && self.participant_.is_answer_key(key, scancode);
  self.ignore_character_ = answer;
  if (action == GLFW_PRESS) {
    if (key == GLFW_KEY_F12 || key == GLFW_KEY_ESCAPE) {
      self.send_command(ConsoleCommand::Kind::emergency_zero, emergency_key_name(key));
    } else if (answer || !typing) {
      self.participant_.handle_key(key, scancode);
    }
  }
  if (answer) return;
  // Dear ImGui samples keys once a frame: a key pressed and released between two frames is released
  // after the next one.
  if (action == GLFW_PRESS) self.fresh_keys_.push_back(key);
  if (action == GLFW_RELEASE &&
      std::count(self.fresh_keys_.begin(), self.fresh_keys_.end(), key) > 0) {
    self.late_releases_.push_back({key, scancode, mods});
  } else {
    ImGui_ImplGlfw_KeyCallback(window, key, scancode, action, mods);
  }
}

void ConsoleWindow::on_character(GLFWwindow* window, unsigned character) {
  auto& self = *static_cast<ConsoleWindow*>(glfwGetWindowUserPointer(window));
  if (!ImGui::GetIO().WantTextInput) self.participant_.handle_character(character);
  if (!self.ignore_character_) ImGui_ImplGlfw_CharCallback(window, character);
}

void ConsoleWindow::on_pointer(GLFWwindow* window, double, double y) {
  auto& self = *static_cast<ConsoleWindow*>(glfwGetWindowUserPointer(window));
  self.pointer_y_ = y;
  self.view_->highlight_emergency(self.view_->in_emergency_button(static_cast<float>(y)));
}

void ConsoleWindow::on_button(GLFWwindow* window, int button, int action, int mods) {
  auto& self = *static_cast<ConsoleWindow*>(glfwGetWindowUserPointer(window));
  // In the event callback, not in a frame of Dear ImGui, where a drag or an input field could hold
  // the pointer and a slow frame would delay it.
  if (action == GLFW_PRESS &&
      self.view_->in_emergency_button(static_cast<float>(self.pointer_y_))) {
    self.send_command(ConsoleCommand::Kind::emergency_zero, "the EMERGENCY button");
    return;
  }
  // Without a window manager nothing else moves the keyboard focus on a click.
  if (action == GLFW_PRESS && glfwGetWindowAttrib(window, GLFW_FOCUSED) == GLFW_FALSE) {
    glfwFocusWindow(window);
  }
  ImGui_ImplGlfw_MouseButtonCallback(window, button, action, mods);
}

void ConsoleWindow::draw() {
  const double now = static_cast<double>(settings_.clock->now_ns()) * 1e-9;
  if (auto state = states_.take()) view_->update(std::move(*state), now);
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  if (width <= 0 || height <= 0 || was_destroyed(window_)) return;
  glfwMakeContextCurrent(window_);
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  const auto held = [&](int left, int right) {
    for (GLFWwindow* const window : {window_, participant_.handle()}) {
      if (glfwGetKey(window, left) == GLFW_PRESS || glfwGetKey(window, right) == GLFW_PRESS) {
        return true;
      }
    }
    return false;
  };
  const Modifiers modifiers{held(GLFW_KEY_LEFT_CONTROL, GLFW_KEY_RIGHT_CONTROL),
                            held(GLFW_KEY_LEFT_SHIFT, GLFW_KEY_RIGHT_SHIFT)};
  for (ConsoleCommand& command : view_->draw(now, modifiers)) {
    send_command(command.kind, std::move(command.text));
  }
  fresh_keys_.clear();
  for (const Release& up : late_releases_) {
    ImGui_ImplGlfw_KeyCallback(window_, up.key, up.scancode, GLFW_RELEASE, up.mods);
  }
  late_releases_.clear();
  ImGui::Render();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, width, height);
  glClearColor(0, 0, 0, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glfwSwapBuffers(window_);
}

}  // namespace palpate::runner::display
