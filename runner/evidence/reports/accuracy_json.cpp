#include "runner/evidence/accuracy/peers.h"
#include "runner/evidence/reports/accuracy_report.h"
#include "runner/evidence/reports/scene_report.h"

namespace palpate::runner::evidence {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(int value) { return value != 0 ? Json(value) : Json(); }

Json settings_json(const evidence::AccuracySettings& s) {
  return {{"paths", s.paths},
          {"contact_ticks", s.contact_ticks},
          {"stylus_length_m", s.length},
          {"most_triangles", s.most_triangles},
          {"stiffness_n_per_m", evidence::kStiffness},
          {"least_flat_angle_rad", evidence::kFlat}};
}

Json methods_json() {
  Json methods = Json::array();
  for (const evidence::MethodDefinition& method : evidence::contact_methods()) {
    methods.push_back({{"name", method.name},
                       {"description", method.description},
                       {"keeps_its_side", method.keeps_side}});
  }
  return methods;
}

Json peers_json() {
  Json peers = Json::array();
  for (const evidence::PeerLibrary& library : evidence::peer_libraries()) {
    peers.push_back({{"name", library.name},
                     {"present", library.make != nullptr},
                     {"version", library.make ? Json(library.version) : Json()}});
  }
  return peers;
}

Json recommended_json(const AccuracyReport& report) {
  Json recommended = Json::array();
  for (const std::string& shape : measured_shapes(report)) {
    const int hand = evidence::triangles_for(report.rows, shape, kHand);
    const int device = evidence::triangles_for(report.rows, shape, kDevice);
    recommended.push_back({{"shape", shape},
                           {"triangles_for_hand", or_null(hand)},
                           {"triangles_for_device", or_null(device)},
                           {"sentence", recommendation(report, shape)}});
  }
  return recommended;
}

Json spread_json(const evidence::ErrorSpread& s, const char* unit) {
  const std::string u(unit);
  return {{"count", s.count}, {"rms_" + u, s.rms}, {"p999_" + u, s.p999}, {"worst_" + u, s.worst}};
}

Json errors_json(const evidence::ErrorSummary& e) {
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

Json row_json(const evidence::AccuracyRow& row) {
  const bool subdivided = traits_of_shape(row.shape).subdivisions;
  return {{"shape", row.shape},
          {"triangles", row.triangles},
          {"facets", row.facets},
          {"edges", row.edges},
          {"subdivisions", subdivided ? Json(row.subdivisions) : Json()},
          {"segments", or_null(row.segments)},
          {"probe", row.probe},
          {"method", row.method},
          {"ns_per_tick", row.ns_per_tick},
          {"against_shape", errors_json(row.shape_errors)},
          {"against_polyhedron", errors_json(row.polyhedron_errors)}};
}

Json first_contact_json(const AccuracyReport& report) {
  Json json;
  for (const FirstContactStudy& study : report.first_contacts) {
    for (const evidence::FirstContactLoss& loss : study.speeds) {
      json["rows"].push_back({{"shape", study.shape},
                              {"speed_m_per_s", loss.speed},
                              {"turning_rad_per_s", loss.turning},
                              {"entries", loss.entries},
                              {"paper_missed", loss.paper_missed},
                              {"paper_never", loss.paper_never},
                              {"paper_early", loss.paper_early},
                              {"exact_missed", loss.exact_missed}});
    }
  }
  json["paper_test_ns"] = report.paper_test_ns;
  json["exact_test_ns"] = report.exact_test_ns;
  return json;
}

Json extreme_json(const ExtremeRow& row) {
  return {{"name", row.name},           {"title", row.title},
          {"measure", row.measure},     {"probe", row.probe},
          {"ticks", row.result.ticks},  {"in_contact", row.result.in_contact},
          {"worst", row.result.worst},  {"allowed", row.result.limit},
          {"holds", row.result.passed}, {"detail", row.result.detail}};
}

Json search_json(const evidence::SearchCounts& c, std::uint64_t seed) {
  return {{"seed", seed},
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

Json unions_json(const AccuracyReport& report) {
  Json json = {{"seeds", report.union_settings.seeds}, {"ticks", report.union_settings.ticks}};
  for (const evidence::UnionMethod& method : evidence::union_methods()) {
    json["methods"].push_back({{"name", method.name}, {"description", method.description}});
  }
  for (const evidence::UnionRow& row : report.unions) {
    json["rows"].push_back({{"case", row.name},
                            {"truth", row.truth},
                            {"segments", row.segments},
                            {"method", row.method},
                            {"ns_per_tick", row.ns_per_tick},
                            {"ticks", row.ticks},
                            {"in_contact", row.in_contact},
                            {"inside", row.one_ideal_tool ? Json(row.inside) : Json()},
                            {"off_by_a_tenth", row.off_by_a_tenth},
                            {"force", spread_json(row.force, "n")}});
  }
  return json;
}

Json soft_json(const AccuracyReport& report) {
  Json rows = Json::array();
  for (const evidence::SoftRow& row : report.soft) {
    rows.push_back({{"case", row.name},
                    {"truth", row.truth},
                    {"nodes", row.nodes},
                    {"elements", row.elements},
                    {"value", row.value},
                    {"reference", row.reference},
                    {"unit", row.unit},
                    {"error", row.error},
                    {"ns_per_step", row.step_ns}});
  }
  return rows;
}

Json union_search_json(const evidence::UnionCounts& c, std::uint64_t seed) {
  return {{"seed", seed},
          {"ticks", c.ticks},
          {"walks", c.walks},
          {"in_contact", c.in_contact},
          {"several_contacts", c.several},
          {"inside", c.inside},
          {"worst_penetration_of_size", c.worst_penetration},
          {"not_minimal", c.not_minimal},
          {"worst_descent_of_size", c.worst_descent},
          {"wrong_force", c.wrong_force},
          {"wrong_torque", c.wrong_torque},
          {"off_place", c.off_place},
          {"not_finite", c.not_finite},
          {"faulted", c.faulted},
          {"wrong", c.wrong()},
          {"lagged", c.lagged},
          {"capped", c.capped},
          {"released", c.released},
          {"on_edge", c.on_edge},
          {"in_gap", c.in_gap},
          {"torques_compared", c.torques},
          {"compared_with_oracle", c.compared},
          {"at_another_minimum", c.elsewhere}};
}

}  // namespace

Json accuracy_json(const AccuracyReport& report) {
  const bool studied = !report.rows.empty();
  Json json = {{"version", 1}, {"program_version", PALPATE_VERSION}};
  if (studied) {
    json["settings"] = settings_json(report.settings);
    json["methods"] = methods_json();
  }
  json["peers"] = peers_json();
  if (studied) json["recommended"] = recommended_json(report);
  json["rows"] = Json::array();
  for (const evidence::AccuracyRow& row : report.rows) json["rows"].push_back(row_json(row));
  if (!report.first_contacts.empty()) json["first_contact"] = first_contact_json(report);
  if (!report.unions.empty()) json["unions"] = unions_json(report);
  for (const BodyRow& row : report.bodies) {
    json["bodies"]["rows"].push_back({{"case", row.name},
                                      {"measure", row.measure},
                                      {"engine", row.engine},
                                      {"error", row.error},
                                      {"us_per_step", row.us_per_step}});
  }
  if (!report.bodies.empty()) {
    const evidence::BodyTickCost& cost = report.body_tick;
    json["bodies"]["eleven_us"] = {{"median", cost.median}, {"p99", cost.p99}, {"max", cost.most}};
  }
  if (!report.soft.empty()) json["soft"] = soft_json(report);
  for (const SceneStudy& study : report.scenes) json["scenes"].push_back(scene_json(study));
  for (const ExtremeRow& row : report.extremes) json["extremes"].push_back(extreme_json(row));
  if (report.search) json["search"] = search_json(*report.search, report.search_seed);
  if (report.union_search)
    json["union_search"] = union_search_json(*report.union_search, report.search_seed);
  return json;
}

}  // namespace palpate::runner::evidence
