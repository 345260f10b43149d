#pragma once
// OpenGL without a display.

namespace palpate::runner {

/// A context of its own, current in the thread that made it, until it is destroyed there.
class OffscreenContext {
 public:
  /// \throws DisplayError saying what is missing
  OffscreenContext();
  ~OffscreenContext();
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

 private:
  void* display_ = nullptr;
  void* context_ = nullptr;
};

}  // namespace palpate::runner
