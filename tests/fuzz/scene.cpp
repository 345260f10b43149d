// Whatever a scene file holds: every fault is named, or its forces are finite.

#include <algorithm>
#include <cstdlib>

#include "protocols/parse.h"
#include "runner/scene_builder.h"
#include "stimuli/convex_mesh.h"
#include "tests/fuzz/feel.h"
#include "tests/fuzz/input_file.h"

namespace {

/// Fine tessellations are slow to build and show nothing more.
bool small(const palpate::stimuli::ObjectSpec& spec) {
  return spec.subdivisions <= 3 && spec.segments <= 256 &&
         std::all_of(spec.parts.begin(), spec.parts.end(), small);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const palpate::testing::InputFile file("scene.json");
  try {
    const auto scene = palpate::protocols::parse_scene(file.write(data, size));
    const auto& objects = scene.objects;
    if (objects.size() > 50 || !std::all_of(objects.begin(), objects.end(), small)) return 0;
    palpate::runner::SceneBuilder builder;
    for (const palpate::rendering::Renderer* renderer :
         {&palpate::rendering::point_renderer(), &palpate::rendering::ray_renderer()}) {
      palpate::testing::feel(
          builder.build(objects, renderer->side_contact(), palpate::runner::tool_of(scene.tool)),
          *renderer);
    }
  } catch (const palpate::protocols::InputError& error) {
    if (error.faults().empty()) std::abort();
  } catch (const palpate::stimuli::MeshError&) {
  }
  return 0;
}
