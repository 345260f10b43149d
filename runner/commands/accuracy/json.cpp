#include "rendering/accuracy/peers.h"
#include "runner/commands/accuracy/report.h"

namespace palpate::runner {
namespace {

using Json = nlohmann::ordered_json;

Json spread_json(const rendering::ErrorSpread& s, const char* unit) {
  const std::string u(unit);
  return {{"count", s.count}, {"rms_" + u, s.rms}, {"p999_" + u, s.p999}, {"worst_" + u, s.worst}};
}

Json errors_json(const rendering::ErrorSummary& e) {
  return {{"ticks", e.ticks},
          {"lost", e.lost},
          {"gave_up", e.gave_up},
          {"phantom", e.phantom},
          {"not_least", e.deeper},
          {"depth", spread_json(e.depth, "m")},
          {"direction", spread_json(e.normal, "rad")},
          {"contact_point", spread_json(e.point, "m")},
          {"force", spread_json(e.force, "n")},
          {"torque", spread_json(e.torque, "nm")}};
}

}  // namespace

Json accuracy_json(const AccuracyReport& report) {
  Json json;
  json["version"] = 1;
  json["program_version"] = PALPATE_VERSION;
  if (!report.rows.empty()) {
    const rendering::AccuracySettings& s = report.settings;
    json["settings"] = {{"paths", s.paths},
                        {"contact_ticks", s.contact_ticks},
                        {"stylus_length_m", s.length},
                        {"most_triangles", s.most_triangles},
                        {"stiffness_n_per_m", rendering::kStiffness},
                        {"least_flat_angle_rad", rendering::kFlat}};
    for (const rendering::MethodKind& method : rendering::accuracy_methods()) {
      json["methods"].push_back({{"name", method.name},
                                 {"description", method.description},
                                 {"keeps_its_side", method.follows_side}});
    }
  }
  for (const rendering::PeerLibrary& library : rendering::peer_libraries()) {
    json["peers"].push_back({{"name", library.name},
                             {"present", library.make != nullptr},
                             {"version", library.make ? Json(library.version) : Json()}});
  }
  if (!report.rows.empty()) {
    for (const std::string& shape : measured_shapes(report)) {
      const int hand = rendering::triangles_for(report.rows, shape, kHand);
      const int device = rendering::triangles_for(report.rows, shape, kDevice);
      json["recommended"].push_back({{"shape", shape},
                                     {"triangles_for_hand", hand ? Json(hand) : Json()},
                                     {"triangles_for_device", device ? Json(device) : Json()},
                                     {"sentence", recommendation(report, shape)}});
    }
  }
  json["rows"] = Json::array();
  for (const rendering::AccuracyRow& row : report.rows) {
    json["rows"].push_back(
        {{"shape", row.shape},
         {"triangles", row.triangles},
         {"facets", row.facets},
         {"edges", row.edges},
         {"subdivisions", needs_of_shape(row.shape).subdivisions ? Json(row.subdivisions) : Json()},
         {"segments", row.segments ? Json(row.segments) : Json()},
         {"probe", row.probe},
         {"method", row.method},
         {"ns_per_tick", row.ns_per_tick},
         {"against_shape", errors_json(row.shape_errors)},
         {"against_polyhedron", errors_json(row.polyhedron_errors)}});
  }
  for (const FirstContactStudy& study : report.first_contacts) {
    for (const rendering::FirstContactLoss& loss : study.speeds) {
      json["first_contact"]["rows"].push_back({{"shape", study.shape},
                                               {"speed_m_per_s", loss.speed},
                                               {"turning_rad_per_s", loss.turning},
                                               {"entries", loss.entries},
                                               {"paper_missed", loss.paper_missed},
                                               {"paper_never", loss.paper_never},
                                               {"paper_early", loss.paper_early},
                                               {"exact_missed", loss.exact_missed}});
    }
  }
  if (!report.first_contacts.empty()) {
    json["first_contact"]["paper_test_ns"] = report.paper_test_ns;
    json["first_contact"]["exact_test_ns"] = report.exact_test_ns;
  }
  for (const ExtremeRow& row : report.extremes) {
    json["extremes"].push_back({{"name", row.name},
                                {"title", row.title},
                                {"measure", row.measure},
                                {"probe", row.probe},
                                {"ticks", row.result.ticks},
                                {"in_contact", row.result.in_contact},
                                {"worst", row.result.worst},
                                {"allowed", row.result.limit},
                                {"holds", row.result.passed},
                                {"detail", row.result.detail}});
  }
  if (report.search) {
    const rendering::SearchCounts& c = *report.search;
    json["search"] = {{"seed", report.search_seed},
                      {"ticks", c.ticks},
                      {"walks", c.walks},
                      {"in_contact", c.in_contact},
                      {"entries", c.entries},
                      {"missed", c.missed},
                      {"passed_through", c.passed_through},
                      {"phantom", c.phantom},
                      {"penetrating", c.penetrating},
                      {"worst_penetration_of_size", c.worst_penetration},
                      {"floating", c.floating},
                      {"shallow", c.shallow},
                      {"wrong_force", c.wrong_force},
                      {"not_finite", c.not_finite},
                      {"endless", c.endless},
                      {"faulted", c.faulted},
                      {"wrong", c.wrong()}};
  }
  return json;
}

}  // namespace palpate::runner
