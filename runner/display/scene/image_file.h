#pragma once
// Pictures as the bytes of files: PNG (libpng), animated WebP (libwebp).

#include <memory>
#include <string>

namespace palpate::runner::display {

/// \param pixels  rows from the top, three bytes a pixel: red, green, blue \throws
/// std::runtime_error
std::string png_of(const std::string& pixels, int width, int height);

/// An animated WebP that repeats forever.
class WebpAnimation {
 public:
  /// \param width, height  px. All functions throw std::runtime_error
  WebpAnimation(int width, int height);
  ~WebpAnimation();
  WebpAnimation(const WebpAnimation&) = delete;
  WebpAnimation& operator=(const WebpAnimation&) = delete;

  /// \param seconds  since the first picture
  void add(const std::string& pixels, double seconds);
  /// \param seconds  since the first picture, at which the last one ends
  std::string finish(double seconds);

 private:
  struct Encoder;
  std::unique_ptr<Encoder> encoder_;
};

}  // namespace palpate::runner::display
