#pragma once
// The work of `palpate render`: forces along a path over a scene, read from and written to CSV.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "rendering/probe.h"
#include "rendering/renderer.h"
#include "rendering/scene_motion.h"
#include "runner/output/outputs.h"
#include "runner/scene_builder.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::touch {

inline constexpr const char* kTrajectoryHeader = "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z";
inline constexpr const char* kSideHeader = ",side_x,side_y,side_z";  ///< may follow
inline constexpr std::size_t kMostPoses = 4'000'000;                 // more than an hour at 1 kHz

struct TimedPose {
  double t = 0;                ///< s
  rendering::LineProbe probe;  ///< of the real stylus
  Vec3 side{0, 0, 0};          ///< of the tool, its +x; zero: not measured
  std::size_t line = 0;        ///< of the file
};

/// The requirement that a pose violates after those before it; "": none.
std::string fault_of(const TimedPose& pose, const std::vector<TimedPose>& before);

/// Coordinates that are not finite are accepted: the renderer reports them in the faults column.
/// \throws InputError with the faults, at most the first ones
std::vector<TimedPose> read_trajectory(const std::string& path);

/// Columns of the forces along a path. \param tool  whether the stylus carries one: more columns
std::vector<std::string> force_columns(bool tool);

/// "non-finite+started-inside".
std::string names_of(std::uint32_t faults);

/// \param row  a CsvText or a data::ColumnTable with force_columns(tool). \param t  s
template <class Row>
void put_forces(Row& row, double t, const rendering::Rendering& r, bool tool) {
  const auto put = [&row](const Vec3& v) { row << v.x << v.y << v.z; };
  row << t;
  for (const Vec3& v :
       {r.force, r.torque, r.ideal.tip, r.ideal.tail, r.deepest.point, r.device1, r.device2})
    put(v);
  row << r.deepest.depth << r.contacts << rendering::to_string(r.deepest.type) << r.object;
  if (tool) {
    row << r.segment;
    put(r.ideal_side);
  }
  row << names_of(r.faults);
  row.end_row();
}

/// The forces as CSV: a row for each tick.
class ForceTable {
 public:
  /// \param tool  whether the stylus carries one: more columns
  explicit ForceTable(bool tool);
  void add(const TimedPose& pose, const rendering::Rendering& rendering);
  const std::string& text() const { return csv_.text(); }
  /// A line for each kind of fault: its number of ticks and its first tick. Empty: no faults.
  std::string warnings(const std::string& path) const;

 private:
  struct Seen {
    std::size_t ticks = 0, first_line = 0;
  };

  bool tool_;
  output::CsvText csv_;
  std::size_t rows_ = 0;
  std::vector<Seen> seen_;  ///< as kRenderFaults
};

/// Moving objects as CSV: a row for each of them at each time.
class BodyTable {
 public:
  BodyTable();
  /// \param t  s
  void add(double t, std::span<const rendering::BodyPose> bodies);
  const std::string& text() const { return csv_.text(); }

 private:
  output::CsvText csv_;
};

/// \throws UsageError: the name is neither point nor ray
const rendering::Renderer& renderer_named(const std::string& name);

/// \param path  named in faults. \throws stimuli::MeshError
rendering::Scene build_scene(SceneBuilder& builder, const std::string& path,
                             const protocols::SceneSpec& spec, const rendering::Renderer& renderer);

/// Gets a row of the path, its tick, and the renderer's state after it.
using TickVisitor = std::function<void(const TimedPose&, const rendering::Rendering&,
                                       const rendering::RenderState&)>;

/// A tick for each pose, in order. \param scene  built from `spec`
void render_along(const rendering::Scene& scene, const protocols::SceneSpec& spec,
                  const rendering::Renderer& renderer, const std::vector<TimedPose>& poses,
                  const TickVisitor& visit);

/// The virtual stylus of a scene that stretches the real one; else the same. m.
rendering::LineProbe virtual_stylus(const protocols::SceneSpec& spec,
                                    const rendering::LineProbe& real);

}  // namespace palpate::runner::touch
