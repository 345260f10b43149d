#include "stimuli/mesh_gltf_accessors.h"

#include <bit>
#include <cmath>
#include <optional>

#include "stimuli/base64.h"
#include "stimuli/little_endian.h"

namespace palpate::stimuli {
namespace {

constexpr std::size_t kByte = 5121, kShort = 5123, kInt = 5125, kFloat = 5126;  // componentType
constexpr const char* kBytes = "a number of bytes";

std::string of_uri(const GltfValue& uri) {
  const std::string text = uri.text("a text");
  const std::size_t comma = text.find(";base64,");
  // Files that a .gltf names were put into it when it was read (with_buffers).
  if (!text.starts_with("data:") || comma == std::string::npos)
    uri.refuse("data in base64 (a .glb has no other files)");
  std::optional<std::string> data = base64_decoded(std::string_view(text).substr(comma + 8));
  if (!data) uri.refuse("data in base64");
  return std::move(*data);
}

}  // namespace

GltfAccessors::GltfAccessors(const GltfDocument& document) : document_(document) {
  const GltfValue list = document.list("buffers");
  for (std::size_t i = 0; i < list.size(); ++i) {
    const GltfValue buffer = list.element(i), uri = buffer.member("uri");
    if (!uri.present() && (i > 0 || !document.binary())) uri.refuse("where its data are");
    buffers_.push_back(uri.present() ? of_uri(uri) : std::string(*document.binary()));
    const GltfValue length = buffer.member("byteLength");
    if (length.whole(kBytes) > buffers_.back().size()) {
      throw GltfRefused{length.place(), std::to_string(length.whole(kBytes)) + " bytes of data",
                        std::to_string(buffers_.back().size())};
    }
  }
}

GltfValue GltfAccessors::accessor(const GltfValue& number) const {
  return document_.named_by(number, "accessors", "accessor");
}

std::size_t GltfAccessors::count(const GltfValue& number) const {
  return accessor(number).member("count").whole("a number of values");
}

std::string_view GltfAccessors::view_of(const GltfValue& accessor, std::size_t bytes_each,
                                        std::size_t& stride) const {
  if (accessor.member("sparse").present())
    accessor.member("sparse").refuse("none (export without sparse accessors)");
  const GltfValue view =
      document_.named_by(accessor.member("bufferView"), "bufferViews", "bufferView");
  const GltfValue step = view.member("byteStride"), length = view.member("byteLength");
  stride = step.whole_or(bytes_each, kBytes);
  if (stride < bytes_each || stride > 252)
    step.refuse(std::to_string(bytes_each) + " to 252 bytes from one value to the next");
  const std::string_view buffer =
      buffers_[view.member("buffer").number_of("buffer", buffers_.size())];
  const std::size_t start = view.member("byteOffset").whole_or(0, kBytes);
  if (start > buffer.size() || length.whole(kBytes) > buffer.size() - start) {
    throw GltfRefused{
        view.place(), "at most the " + std::to_string(buffer.size()) + " bytes of its buffer",
        std::to_string(length.whole(kBytes)) + " bytes from byte " + std::to_string(start)};
  }
  return buffer.substr(start, length.whole(kBytes));
}

GltfAccessors::Values GltfAccessors::values(const GltfValue& accessor,
                                            std::size_t bytes_each) const {
  Values all{};
  const std::string_view view = view_of(accessor, bytes_each, all.stride);
  const std::size_t offset = accessor.member("byteOffset").whole_or(0, kBytes);
  all.count = accessor.member("count").whole("a number of values");
  if (all.count == 0) accessor.member("count").refuse("one value or more");
  const std::size_t room = offset <= view.size() ? view.size() - offset : 0;
  if (room < bytes_each || (all.count - 1) > (room - bytes_each) / all.stride) {
    throw GltfRefused{accessor.place(),
                      "room for " + std::to_string(all.count) + " values of " +
                          std::to_string(bytes_each) + " bytes in its bufferView",
                      std::to_string(room) + " bytes"};
  }
  all.data = view.substr(offset);
  return all;
}

std::vector<Vec3> GltfAccessors::positions(const GltfValue& number) const {
  const GltfValue source = accessor(number);
  const GltfValue type = source.member("type"), component = source.member("componentType");
  if (type.text("\"VEC3\"") != "VEC3") type.refuse("\"VEC3\"");
  if (component.whole("5126") != kFloat) component.refuse("5126 (positions in single precision)");
  const Values all = values(source, 12);
  std::vector<Vec3> positions(all.count);
  for (std::size_t i = 0; i < all.count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto value = std::bit_cast<float>(little_endian(all.data, i * all.stride + 4 * axis));
      if (!std::isfinite(value)) {
        throw GltfRefused{source.place(), "finite coordinates",
                          "infinity or no number at vertex " + std::to_string(i)};
      }
      positions[i][static_cast<int>(axis)] = value;
    }
  }
  return positions;
}

std::vector<std::uint32_t> GltfAccessors::indices(const GltfValue& number,
                                                  std::size_t vertices) const {
  const GltfValue source = accessor(number);
  const GltfValue type = source.member("type"), component = source.member("componentType");
  if (type.text("\"SCALAR\"") != "SCALAR") type.refuse("\"SCALAR\"");
  const std::string kinds = "5121, 5123 or 5125 (unsigned indices)";
  const std::size_t kind = component.whole(kinds);
  const std::size_t size = kind == kByte ? 1 : kind == kShort ? 2 : kind == kInt ? 4 : 0;
  if (size == 0) component.refuse(kinds);
  const Values all = values(source, size);
  std::vector<std::uint32_t> corners(all.count);
  for (std::size_t i = 0; i < all.count; ++i) {
    corners[i] = little_endian(all.data, i * all.stride, size);
    if (corners[i] < vertices) continue;
    throw GltfRefused{source.place(),
                      "numbers of vertices from 0 to " + std::to_string(vertices - 1),
                      std::to_string(corners[i]) + " as number " + std::to_string(i)};
  }
  return corners;
}

}  // namespace palpate::stimuli
