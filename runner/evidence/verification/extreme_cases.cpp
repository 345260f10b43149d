#include "runner/evidence/verification/extreme_cases.h"

#include <span>

#include "runner/evidence/verification/extremes/audited_scene.h"
#include "runner/evidence/verification/extremes/cases.h"

namespace palpate::runner::evidence {

std::span<const ExtremeCase> extreme_cases() {
  using namespace extremes;
  static constexpr ExtremeCase kCases[] = {
      {"sliver", "faces 1,000,000 times as long as wide, all kinds of paths", kLengthError, sliver},
      {"needle", "0.1 m long, 1 um thick", kLengthError, needle},
      {"thin-plate", "0.1 mm thick, crossed at 5 m/s (5 mm a tick)",
       "ticks not held on the side of entry", thin_plate},
      {"parallel-edge", "probe along an edge, exactly or off by 1e-17 to 1e-3 rad and sizes",
       kLengthError, parallel_edge},
      {"through-vertices", "probe through every corner, exactly or off by 1e-16 to 1e-9 m",
       kLengthError, through_vertices},
      {"zero-length", "a probe without length is a point", "worst difference of force, N",
       zero_length},
      {"tiny-length", "probes of 1e-6 down to 5e-324 m", kLengthError, tiny_length},
      {"million-triangles", "1,310,720 triangles with edges of 0.1 mm", kLengthError,
       million_triangles},
      {"small-object", "a sphere of 0.1 mm", kLengthError, small_object},
      {"large-object", "a sphere of 100 m", kLengthError, large_object},
      {"far-object", "a cone 1 km from the origin", kLengthError, far_object},
      {"duplicate-vertices", "every face with corners of its own, faces without area", kLengthError,
       duplicate_vertices},
      {"nearly-coplanar", "facets that meet at 1e-3 to 1e-13 rad", kLengthError, nearly_coplanar},
      {"starts-inside", "a trial that begins inside: no force until it has been left once",
       "force before that, N", starts_inside},
      {"teleports", "an unrelated pose at every tick, up to 100 km away", kLengthError, teleports},
      {"bad-poses", "NaN, infinities and 1,000 km: no force, the fault bit, recovery",
       "force at or difference after a bad pose, N", bad_poses},
      {"closed-paths", "closed paths on one feature, elastic",
       "worst work of a cycle, as a fraction of the energy stored", closed_paths},
      {"closed-paths-lossy", "the same with friction, with damping, with both",
       "most work on the hand in a cycle, as a fraction of the energy stored", closed_paths_lossy},
      {"closed-paths-blend",
       "a stylus that rocks flat on a face, through the blend of equation (2)",
       "worst work of a cycle, J; allowed: force times rocking", closed_paths_in_the_blend},
  };
  return kCases;
}

}  // namespace palpate::runner::evidence
