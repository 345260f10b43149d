#include "rendering/contact.h"

namespace palpate::rendering {

const char* to_string(ContactType type) {
  switch (type) {
    case ContactType::none:
      return "none";
    case ContactType::point_polygon:
      return "point-polygon";
    case ContactType::segment_edge:
      return "segment-edge";
    case ContactType::segment_face:
      return "segment-face";
  }
  return "none";
}

}  // namespace palpate::rendering
