#include "runner/display/scene/image_file.h"

#include <png.h>
#include <webp/encode.h>
#include <webp/mux.h>

#include <cmath>
#include <cstring>
#include <stdexcept>

namespace palpate::runner::display {
namespace {

constexpr float kWebpQuality = 82;
constexpr int kWebpEffort = 3;  // of 6; more is slower

int milliseconds(double seconds) { return static_cast<int>(std::lround(1000 * seconds)); }

}  // namespace

std::string png_of(const std::string& pixels, int width, int height) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string out(size, '\0');
  if (png_image_write_to_memory(&image, out.data(), &size, 0, pixels.data(), 0, nullptr) == 0)
    throw std::runtime_error(std::string("a picture could not be written as PNG: ") +
                             image.message);
  out.resize(size);
  return out;
}

struct WebpAnimation::Encoder {
  int width, height;
  WebPAnimEncoder* encoder = nullptr;
  WebPConfig config{};
};

WebpAnimation::WebpAnimation(int width, int height)
    : encoder_(std::make_unique<Encoder>(Encoder{.width = width, .height = height})) {
  WebPAnimEncoderOptions options;
  if (WebPAnimEncoderOptionsInit(&options) == 0 || WebPConfigInit(&encoder_->config) == 0)
    throw std::runtime_error("libwebp is of another version than the one built with");
  encoder_->config.quality = kWebpQuality;
  encoder_->config.method = kWebpEffort;
  encoder_->config.use_sharp_yuv = 1;  // thin coloured lines
  encoder_->encoder = WebPAnimEncoderNew(width, height, &options);
  if (encoder_->encoder == nullptr)
    throw std::runtime_error("an animation of this size could not be begun");
}

WebpAnimation::~WebpAnimation() { WebPAnimEncoderDelete(encoder_->encoder); }

void WebpAnimation::add(const std::string& pixels, double seconds) {
  WebPPicture picture;
  if (WebPPictureInit(&picture) == 0) throw std::runtime_error("libwebp is of another version");
  picture.width = encoder_->width;
  picture.height = encoder_->height;
  picture.use_argb = 1;
  const bool taken =
      WebPPictureImportRGB(&picture, reinterpret_cast<const std::uint8_t*>(pixels.data()),
                           3 * encoder_->width) != 0 &&
      WebPAnimEncoderAdd(encoder_->encoder, &picture, milliseconds(seconds), &encoder_->config) !=
          0;
  WebPPictureFree(&picture);
  if (!taken)
    throw std::runtime_error(std::string("a picture could not be added to the animation: ") +
                             WebPAnimEncoderGetError(encoder_->encoder));
}

std::string WebpAnimation::finish(double seconds) {
  WebPData data;
  WebPDataInit(&data);
  if (WebPAnimEncoderAdd(encoder_->encoder, nullptr, milliseconds(seconds), nullptr) == 0 ||
      WebPAnimEncoderAssemble(encoder_->encoder, &data) == 0)
    throw std::runtime_error(std::string("the animation could not be put together: ") +
                             WebPAnimEncoderGetError(encoder_->encoder));
  std::string out(reinterpret_cast<const char*>(data.bytes), data.size);
  WebPDataClear(&data);
  return out;
}

}  // namespace palpate::runner::display
