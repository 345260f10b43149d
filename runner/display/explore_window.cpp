#include "runner/display/explore_window.h"

#include <epoxy/gl.h>
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <utility>

#include "runner/display/explore_view.h"
#include "runner/display/fonts.h"
#include "runner/display/window_layout.h"
#include "runner/display/x11_errors.h"

namespace palpate::runner::display {
namespace {

constexpr double kExploreFrame = 1.0 / 60;                 // s
constexpr double kEveryMonitors = 0.5;                     // s
constexpr int kStepsOfPage = 100;                          // ticks
constexpr int kExploreWidth = 1480, kExploreHeight = 900;  // px, at scale 1

double steady_seconds() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

class ExploreWindow {
 public:
  ExploreWindow(ExploreSettings settings, TouchSource& source)
      : end_requested_(settings.end_requested), source_(source) {
    if (!start_glfw())
      throw DisplayError("no graphical display: " + glfw_reason() +
                         "; --frames and --animation need none");
    try {
      open(std::move(settings));
    } catch (...) {
      glfwTerminate();
      throw;
    }
  }
  ExploreWindow(const ExploreWindow&) = delete;
  ExploreWindow& operator=(const ExploreWindow&) = delete;
  ~ExploreWindow() = default;  // run() closes it

  void run() {
    try {
      double before = steady_seconds();
      while (glfwWindowShouldClose(window_) == GLFW_FALSE && !gone_ && !ended()) {
        if (connection_lost()) throw DisplayLost();
        const double started = steady_seconds();
        if (started >= look_at_monitors_) {
          bring_into_sight(window_);
          look_at_monitors_ = started + kEveryMonitors;
        }
        draw(started - before);
        before = started;
        // After a slow frame (software rendering) wait as long as it took, to leave half of the
        // time.
        const double drawn = steady_seconds();
        const double next = std::max(started + kExploreFrame, 2 * drawn - started);
        glfwPollEvents();
        for (double now = steady_seconds(); now < next && !ended(); now = steady_seconds())
          glfwWaitEventsTimeout(next - now);
      }
      source_.emergency_zero();
      finish_clip();
      close();
    } catch (const DisplayLost&) {
      // Without a display OpenGL and GLFW must not be called: leak what they hold.
      source_.emergency_zero();
      static_cast<void>(view_.release());
      throw DisplayError("the display was lost; forces are off");
    }
  }

 private:
  bool ended() const { return end_requested_ && end_requested_(); }

  void open(ExploreSettings settings) {
    const double scale = single_scale(settings.ui_scale);
    window_ = make_window(settings.title + " - palpate explore",
                          lay_out_single(kExploreWidth, kExploreHeight, scale));
    context_ = begin_imgui(window_, {settings.title}, static_cast<float>(scale));
    glfwSetWindowUserPointer(window_, this);
    glfwSetKeyCallback(window_, &ExploreWindow::on_key);
    glfwSetCharCallback(window_, &ImGui_ImplGlfw_CharCallback);
    glfwSetCursorPosCallback(window_, &ExploreWindow::on_pointer);
    glfwSetMouseButtonCallback(window_, &ExploreWindow::on_button);
    view_ = std::make_unique<ExploreView>(std::move(settings), source_);
    flag_when_destroyed(window_, gone_);
    handle_display_errors();
    glfwShowWindow(window_);
  }

  /// Saves a clip that is being drawn: all of it, or the pictures so far if a signal or the user
  /// asks again to end.
  void finish_clip() {
    if (gone_ || was_destroyed(window_)) return;
    glfwMakeContextCurrent(window_);
    glfwSetWindowShouldClose(window_, GLFW_FALSE);
    int shown = -1;
    const std::string kept = view_->finish_clip([&](double done) {
      glfwPollEvents();
      if (connection_lost()) throw DisplayLost();
      const int percent = static_cast<int>(100 * done);
      if (percent != shown) {
        shown = percent;
        const std::string title = "Keeping the clip: " + std::to_string(percent) + " %";
        glfwSetWindowTitle(window_, title.c_str());
      }
      return !ended() && !gone_ && glfwWindowShouldClose(window_) == GLFW_FALSE;
    });
    if (!kept.empty()) std::cout << kept << std::endl;
  }

  void close() {
    view_.reset();
    end_imgui(context_);
    glfwDestroyWindow(window_);
    glfwTerminate();
  }

  static void on_key(GLFWwindow* window, int key, int scancode, int action, int mods) {
    auto& self = *static_cast<ExploreWindow*>(glfwGetWindowUserPointer(window));
    // At once, whichever element has the keyboard focus.
    if (action == GLFW_PRESS && (key == GLFW_KEY_F12 || key == GLFW_KEY_ESCAPE))
      self.source_.emergency_zero();
    ImGui_ImplGlfw_KeyCallback(window, key, scancode, action, mods);
    if (action == GLFW_RELEASE || ImGui::GetIO().WantTextInput) return;
    const int ticks = (mods & GLFW_MOD_SHIFT) != 0 ? kStepsOfPage : 1;
    if (key == GLFW_KEY_SPACE && action == GLFW_PRESS) self.view_->pause_or_resume();
    if (key == GLFW_KEY_LEFT) self.view_->step(-ticks);
    if (key == GLFW_KEY_RIGHT) self.view_->step(ticks);
    if (key == GLFW_KEY_S && action == GLFW_PRESS) self.keep_ = true;
    if (key == GLFW_KEY_C && action == GLFW_PRESS) self.view_->keep_clip();
  }

  static void on_pointer(GLFWwindow* window, double, double y) {
    auto& self = *static_cast<ExploreWindow*>(glfwGetWindowUserPointer(window));
    self.pointer_y_ = static_cast<float>(y);
    self.view_->highlight_emergency(self.view_->in_emergency_button(self.pointer_y_));
  }

  static void on_button(GLFWwindow* window, int button, int action, int mods) {
    auto& self = *static_cast<ExploreWindow*>(glfwGetWindowUserPointer(window));
    // In the event callback, not in a frame of Dear ImGui, where a drag could hold the pointer and
    // a slow frame would delay it.
    if (action == GLFW_PRESS && self.view_->in_emergency_button(self.pointer_y_)) {
      self.source_.emergency_zero();
      return;
    }
    if (action == GLFW_PRESS && glfwGetWindowAttrib(window, GLFW_FOCUSED) == GLFW_FALSE)
      glfwFocusWindow(window);
    ImGui_ImplGlfw_MouseButtonCallback(window, button, action, mods);
  }

  void draw(double seconds) {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_, &width, &height);
    if (width <= 0 || height <= 0 || was_destroyed(window_)) return;
    const auto held = [this](int left, int right) {
      return glfwGetKey(window_, left) == GLFW_PRESS || glfwGetKey(window_, right) == GLFW_PRESS;
    };
    glfwMakeContextCurrent(window_);
    if (keep_) view_->keep_picture();
    keep_ = false;
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    view_->draw(seconds, {held(GLFW_KEY_LEFT_CONTROL, GLFW_KEY_RIGHT_CONTROL),
                          held(GLFW_KEY_LEFT_SHIFT, GLFW_KEY_RIGHT_SHIFT)});
    ImGui::Render();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, width, height);
    glClearColor(0, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    glfwSwapBuffers(window_);
  }

  std::function<bool()> end_requested_;
  TouchSource& source_;
  GLFWwindow* window_ = nullptr;
  ImGuiContext* context_ = nullptr;
  std::unique_ptr<ExploreView> view_;
  float pointer_y_ = 1e6F;
  bool gone_ = false, keep_ = false;
  double look_at_monitors_ = 0;  ///< s
};

}  // namespace

void explore_in_window(ExploreSettings settings, TouchSource& source) {
  ExploreWindow(std::move(settings), source).run();
}

}  // namespace palpate::runner::display
