#include "protocols/parse.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "data/base/checksum.h"
#include "data/base/random.h"
#include "tests/protocols/parsed_faults.h"
#include "tests/shared/peak_memory.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::protocols {
namespace {

namespace fs = std::filesystem;

const std::string kFolder = PALPATE_SOURCE_DIR "/tests/protocols/";

std::string text_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::vector<fs::path> json_files(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path& path = entry.path();
    const bool schema = path.stem().extension() == ".schema" ||
                        path.filename().string().find(".texts.") != std::string::npos;
    if (path.extension() == ".json" && !schema) files.push_back(path);
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<Fault> faults_of(const std::string& text) {
  return faults_when([&] { parse_protocol_text(text, "p.json"); });
}

TEST(Parse, AcceptsGoodFiles) {
  const std::vector<fs::path> files = json_files(kFolder + "good");
  EXPECT_EQ(files.size(), 15u);
  for (const fs::path& file : files) EXPECT_NO_THROW(parse_file(file)) << file;
}

TEST(Parse, AcceptsThePublishedProtocols) {
  const std::vector<fs::path> files = json_files(PALPATE_SOURCE_DIR "/protocols");
  EXPECT_GE(files.size(), 4u);
  for (const fs::path& file : files) {
    EXPECT_NO_THROW(EXPECT_EQ(parse_protocol(file.string()).name, file.stem())) << file;
  }
}

// Every bad file has a list of its faults' places: all of them, and no others.
TEST(Parse, NamesEveryFaultOfBadFiles) {
  const std::vector<fs::path> files = json_files(kFolder + "bad");
  EXPECT_GE(files.size(), 40u);
  for (const fs::path& file : files) {
    std::vector<std::string> expected, places;
    std::istringstream lines(text_of(fs::path(file).replace_extension(".faults")));
    for (std::string line; std::getline(lines, line);) expected.push_back(line);
    try {
      parse_file(file);
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) {
        EXPECT_EQ(fault.file, file);
        EXPECT_GT(fault.line, 0) << fault.location;
        EXPECT_FALSE(fault.expected.empty());
        places.push_back(fault.location);
      }
    }
    std::sort(expected.begin(), expected.end());
    std::sort(places.begin(), places.end());
    EXPECT_EQ(places, expected) << file;
  }
}

TEST(Parse, ReadsEveryKey) {
  const std::string file = kFolder + "good/everything.json";
  const Protocol p = parse_protocol(file);
  EXPECT_EQ(p.name, "everything-2");
  EXPECT_EQ(p.title, "Alles, mit Umlauten: äöü 触覚");
  EXPECT_EQ(p.description, "Every key once.");
  EXPECT_EQ(p.renderers, (std::vector{RendererKind::ray, RendererKind::point}));
  EXPECT_EQ(p.renderer_order, RendererOrder::fixed);
  ASSERT_EQ(p.stimuli.size(), 6u);
  const stimuli::ObjectSpec& ball = p.stimuli[0].object;
  EXPECT_EQ(p.stimuli[0].name, "ball");
  EXPECT_EQ(ball.shape, stimuli::ShapeKind::sphere);
  EXPECT_EQ(ball.radius, 0.02);
  EXPECT_EQ(ball.subdivisions, 3);
  EXPECT_EQ(ball.pose.position, Vec3(0, 0, 0.01));
  EXPECT_EQ(ball.pose.orientation, Quat(0.6, 0, 0.8, 0));
  EXPECT_EQ(ball.material.stiffness, 500);
  EXPECT_EQ(ball.material.damping, 1);
  EXPECT_EQ(ball.material.friction_static, 0.5);
  EXPECT_EQ(ball.material.friction_dynamic, 0.25);
  ASSERT_EQ(ball.material.layers.size(), 2u);
  EXPECT_EQ(ball.material.layers[0].damping, 0.5);
  EXPECT_EQ(ball.material.layers[0].break_force, std::nullopt);
  EXPECT_EQ(ball.material.layers[1].break_force, 3);
  EXPECT_EQ(ball.material.layers[1].damping, 0);
  EXPECT_EQ(ball.material.layers[1].depth, 0.002);
  EXPECT_EQ(ball.material.layers[1].stiffness, 900);
  const stimuli::ObjectSpec& hat = p.stimuli[1].object;
  EXPECT_EQ(hat.shape, stimuli::ShapeKind::cone);
  EXPECT_EQ(hat.height, 0.03);
  EXPECT_EQ(hat.segments, 32);
  EXPECT_EQ(hat.material.stiffness, 600);
  EXPECT_EQ(hat.material.damping, 0.5);  // the protocol's
  EXPECT_EQ(p.stimuli[2].object.shape, stimuli::ShapeKind::cylinder);
  EXPECT_EQ(p.stimuli[2].object.material.damping, 2);
  EXPECT_EQ(p.stimuli[2].object.material.friction_static, 0.125);  // one value serves for both
  EXPECT_EQ(p.stimuli[2].object.material.friction_dynamic, 0.125);
  EXPECT_TRUE(p.stimuli[3].object.material.layers.empty());
  EXPECT_EQ(p.stimuli[2].object.material.stiffness, 400);
  EXPECT_EQ(p.stimuli[3].object.edge, 0.04);
  EXPECT_EQ(p.stimuli[4].object.file, kFolder + "good/tetrahedron.obj");
  EXPECT_EQ(p.stimuli[4].object.scale, 1.25);
  const stimuli::ObjectSpec& dumbbell = p.stimuli[5].object;
  ASSERT_EQ(dumbbell.parts.size(), 2u);
  EXPECT_EQ(dumbbell.parts[0].material.stiffness, 700);  // the compound's
  EXPECT_EQ(dumbbell.parts[1].parts.at(0).material.stiffness, 700);
  EXPECT_EQ(dumbbell.parts[1].parts.at(0).material.damping, 3);
  EXPECT_EQ(p.repetitions, 12);
  EXPECT_EQ(p.order.kind, OrderKind::random);
  EXPECT_EQ(p.order.max_run, 2);
  EXPECT_EQ(p.order.min_distance, std::nullopt);
  EXPECT_EQ(p.blocks_per_renderer, 3);
  EXPECT_EQ(p.orientation, OrientationKind::listed);
  ASSERT_EQ(p.orientations.size(), 2u);
  EXPECT_NEAR(glm::length(p.orientations[1]), 1, 1e-15);  // normalised from 7 digits
  EXPECT_EQ(p.practice.repetitions, 1);
  EXPECT_EQ(p.practice.criterion, 0.75);
  EXPECT_EQ(p.practice.max_rounds, 3);
  EXPECT_EQ(p.sessions.count, 2);
  EXPECT_EQ(p.sessions.max_minutes, 45);
  EXPECT_EQ(p.sessions.warm_up_trials, 4);
  EXPECT_EQ(p.breaks.every_trials, 24);
  EXPECT_EQ(p.breaks.min_seconds, 15);
  EXPECT_EQ(p.response.keys.at("4"), "die");
  EXPECT_EQ(p.response.keys.at("ä"), "can");
  EXPECT_EQ(p.response.keys.at("left"), "hat");
  EXPECT_EQ(answer_label(p, "hat"), "Hut 帽子");
  EXPECT_EQ(answer_label(p, "Tetra-4"), "Tetra-4");
  EXPECT_EQ(p.texts.move_away + p.texts.ready + p.texts.go + p.texts.wait + p.texts.other_key,
            "Weg von der MitteBereitLosBitte wartenDiese Taste gilt nicht");
  EXPECT_EQ(p.blocks.front().time_out, 20.5);
  EXPECT_TRUE(p.blocks.front().feedback);
  EXPECT_EQ(p.stylus.length, 0.1);
  EXPECT_EQ(p.stylus.grip, 0.05);
  EXPECT_EQ(p.workspace.centre, Vec3(0, 0.01, 0.02));
  EXPECT_EQ(p.workspace.scale, 1.5);
  ASSERT_EQ(p.tool.segments.size(), 2u);
  EXPECT_EQ(p.tool.segments[0].to, Vec3(0, 0, 0.1));
  EXPECT_EQ(p.tool.segments[1].from, Vec3(0));
  EXPECT_EQ(p.tool.segments[1].to, Vec3(0.01, 0, -0.02));
  ASSERT_TRUE(p.reach);
  EXPECT_EQ(p.reach->factor, 5);
  EXPECT_EQ(p.reach->pivot, ReachSpec::Pivot::tail);
  EXPECT_EQ(p.material.stiffness, 400);
  EXPECT_EQ(p.servo_rate, 2000);
  EXPECT_EQ(p.home.rest, 0.25);
  EXPECT_EQ(p.home.margin, 0.02);
  EXPECT_EQ(p.texts.instructions, "Tasten!");
  EXPECT_EQ(p.texts.practice, "Übung");
  EXPECT_EQ(p.texts.break_text, "Pause");
  EXPECT_EQ(p.texts.end, "Danke");
  EXPECT_TRUE(p.samples);
  EXPECT_EQ(p.seed, 18446744073709551615u);
  EXPECT_EQ(p.source_text, text_of(file));
  EXPECT_EQ(p.sha256, checksum_hex(text_of(file)));
}

TEST(Parse, KeepsDefaults) {
  const Protocol p = parse_protocol(kFolder + "good/minimal.json");
  EXPECT_EQ(p.renderer_order, RendererOrder::counterbalanced);
  EXPECT_EQ(p.orientation, OrientationKind::uniform);
  EXPECT_EQ(p.practice.max_rounds, 1);
  EXPECT_EQ(p.blocks.front().time_out, 60);
  EXPECT_EQ(p.stylus.length, 0.12);
  EXPECT_EQ(p.stimuli[0].object.material.stiffness, 800);
  EXPECT_EQ(p.seed, 0u);
  EXPECT_FALSE(p.order.max_run);
  EXPECT_TRUE(p.tool.segments.empty());
  EXPECT_FALSE(p.reach);
}

TEST(Parse, ReadsAScene) {
  const SceneSpec scene = parse_scene(kFolder + "good/scene.json");
  EXPECT_TRUE(scene.tool.segments.empty());
  EXPECT_FALSE(scene.reach);
  const std::vector<stimuli::ObjectSpec>& objects = scene.objects;
  ASSERT_EQ(objects.size(), 3u);
  EXPECT_EQ(objects[0].shape, stimuli::ShapeKind::cube);
  EXPECT_EQ(objects[0].edge, 0.05);
  EXPECT_EQ(objects[1].file, kFolder + "good/tetrahedron.obj");
  EXPECT_EQ(objects[2].parts.size(), 1u);
}

TEST(ParseScene, AToolHasOneToSixteenSegments) {
  const auto faults_with = [](int segments) {
    std::string list;
    for (int i = 0; i < segments; ++i) {
      list += (i == 0 ? "" : ", ");
      list += R"({"from_m": [0, 0, 0], "to_m": [0, 0, 0.1]})";
    }
    try {
      const SceneSpec scene = parse_scene_text(
          R"({"objects": [{"shape": "cube", "edge_m": 0.05}], "tool": {"segments": [)" + list +
              "]}}",
          "s.json");
      EXPECT_EQ(scene.tool.segments.size(), static_cast<std::size_t>(segments));
      return std::string();
    } catch (const InputError& error) {
      return error.faults().at(0).location;
    }
  };
  EXPECT_EQ(faults_with(1), "");
  EXPECT_EQ(faults_with(16), "");
  EXPECT_EQ(faults_with(17), "/tool/segments");
  EXPECT_EQ(faults_with(0), "/tool/segments");
}

TEST(Parse, ReadsASceneWithToolReachAndLayers) {
  const SceneSpec scene = parse_scene(kFolder + "good/scene-tool.json");
  ASSERT_EQ(scene.objects.size(), 1u);
  const stimuli::Material& material = scene.objects[0].material;
  EXPECT_EQ(material.stiffness, 0);  // felt only below the surface
  ASSERT_EQ(material.layers.size(), 2u);
  EXPECT_EQ(material.layers[0].break_force, std::nullopt);  // null: it does not break
  EXPECT_EQ(material.layers[1].break_force, 2.5);
  ASSERT_EQ(scene.tool.segments.size(), 2u);
  EXPECT_EQ(scene.tool.segments[1].to, Vec3(0.02, 0, -0.01));
  ASSERT_TRUE(scene.reach);
  EXPECT_EQ(scene.reach->factor, 5);
  EXPECT_EQ(scene.reach->pivot, ReachSpec::Pivot::point);
  EXPECT_EQ(scene.reach->point, Vec3(0, 0.1, 0));
}

TEST(Parse, FaultsOfWholeFilesHaveNoPlace) {
  EXPECT_STREQ(InputError({{"none", "", "expected a firmware file"}}).what(),
               "none: expected a firmware file");
}

TEST(Parse, SaysWhereAndWhat) {
  std::string text = text_of(kFolder + "good/minimal.json");
  text.replace(text.find("radius_m"), 8, "raduis_m");
  try {
    parse_protocol_text(text, "p.json");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "p.json:5: /stimuli/0/radius_m: missing; this key is required\n"
                 "p.json:5: /stimuli/0/raduis_m: unknown key; did you mean 'radius_m'?");
  }
}

TEST(Parse, RefusesLargeRecordings) {
  const palpate::testing::TemporaryFolder folder;
  std::ofstream(folder / "tap.wav") << "RIFF";
  std::ofstream(folder / "p.json") << R"({"version": 2, "name": "p", "renderers": ["point"],
    "stimuli": [{"name": "a", "shape": "cube", "edge_m": 0.05, "sound": {"kind": "file", "file": "tap.wav"}}],
    "blocks": [{"name": "b", "task": "rate", "stimuli": ["a"], "repetitions": 1}]})";
  EXPECT_NO_THROW(parse_protocol(folder / "p.json"));
  fs::resize_file(folder / "tap.wav", (std::uintmax_t{16} << 20U) + 1);
  const std::vector<Fault> faults = faults_when([&] { parse_protocol(folder / "p.json"); });
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].location, "/stimuli/0/sound/file");
}

TEST(Parse, SaysThatAMeshFileIsAFolder) {
  const palpate::testing::TemporaryFolder folder;
  fs::create_directory(folder / "a.obj");
  std::ofstream(folder / "s.json") << R"({"objects": [{"shape": "mesh", "file": "a.obj"}]})";
  try {
    parse_scene(folder / "s.json");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("/a.obj is a folder"), std::string::npos)
        << error.what();
  }
}

TEST(Parse, CountsLinesOfNumbersBeforeANewline) {
  const std::vector<Fault> faults = faults_of("{\n\"version\":\n7\n,\n\"seed\": -1\n}");
  ASSERT_GE(faults.size(), 2u);
  EXPECT_EQ(faults.front().location, "/version");
  EXPECT_EQ(faults.front().line, 3);
  EXPECT_EQ(faults.back().location, "/seed");
  EXPECT_EQ(faults.back().line, 5);
}

TEST(Parse, KeysCannotBreakTheListOfFaults) {
  try {
    parse_protocol_text("{\"a\\n\\u001b[2Jb\": 1}", "p.json");
    FAIL();
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("/a\\u000a\\u001b[2Jb: unknown key"), std::string::npos) << what;
    EXPECT_EQ(std::count(what.begin(), what.end(), '\n') + 1,
              std::ptrdiff_t(error.faults().size()));
  }
}

/// Peak memory added by reading the text, which is refused with a short message.
std::size_t peak_of_refusing(const std::string& text) {
  const auto peak = peak_memory([&] {
    try {
      parse_protocol_text(text, "p.json");
    } catch (const InputError& error) {
      if (std::string(error.what()).size() < 4U << 20U) return;
    }
    _exit(2);
  });
  EXPECT_TRUE(peak) << text.substr(0, 60);
  return peak.value_or(0);
}

std::string repeated(const std::string& piece, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) text += (i > 0 ? "," : "") + piece;
  return text;
}

// Small texts that would grow: values store the keys around them, faults store their places.
TEST(Parse, MemoryIsInProportionToTheText) {
  constexpr std::size_t kMost = 32U << 20U;
  const std::string key(200'000, 'k'), fair(250, 'k');
  EXPECT_LT(peak_of_refusing("{\"" + key + "\": [" + repeated("1", 20'000) + "]}"), kMost);
  EXPECT_LT(peak_of_refusing("{\"stimuli\": [" + repeated("{}", 20'000) + "]}"), kMost);
  EXPECT_LT(peak_of_refusing("{" + repeated("\"" + fair + "\": 1", 2'000) + "}"), kMost);
  std::string deep, end;
  for (int i = 0; i < 60; ++i) {
    deep += "{\"" + fair + "\": ";
    end += "}";
  }
  EXPECT_LT(peak_of_refusing(deep + "[" + repeated("1", 20'000) + "]" + end), kMost);
  EXPECT_LT(peak_of_refusing("[" + repeated("1", 4'000'000) + "]"), kMost);
}

TEST(Parse, NamesExceededLimits) {
  const auto first = [](const std::string& text) { return faults_of(text).at(0); };
  const Fault key = first("{\n\"" + std::string(300, 'k') + "\": 1}");
  EXPECT_EQ(key.location, "/");
  EXPECT_NE(key.expected.find("at most 256 bytes, found one of 300 on line 2"), std::string::npos);
  const Fault values = first("{\"a\": [\n" + repeated("1", 300'000) + "]}");
  EXPECT_EQ(values.location, "/a");
  EXPECT_NE(values.expected.find("at most 200000 values"), std::string::npos);
  const std::vector<Fault> many = faults_of("{" + repeated("\"\": 1", 5'000) + "}");
  EXPECT_EQ(many.size(), 1001u);
  EXPECT_EQ(many.back().expected.substr(0, 4), "and ");
}

TEST(Parse, UnreadableFilesAreInputErrors) {
  EXPECT_THROW(parse_protocol(kFolder + "nowhere.json"), InputError);
  EXPECT_THROW(parse_protocol(kFolder), InputError);
  EXPECT_THROW(parse_scene(kFolder + "nowhere.json"), InputError);
}

// Damaged files are refused or accepted; nothing else may happen.
TEST(Parse, SurvivesDamage) {
  const std::string good = text_of(kFolder + "good/everything.json");
  const std::string pieces = "{}[]\",:0-1e9.\\\xff\n truenull";
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string text = good;
    for (std::uint64_t n = 1 + random.below(3); n > 0; --n) {
      const std::size_t at = random.below(text.size());
      switch (random.below(3)) {
        case 0:
          text[at] = pieces[random.below(pieces.size())];
          break;
        case 1:
          text.erase(at, 1 + random.below(20));
          break;
        default:
          text.insert(at, 1, pieces[random.below(pieces.size())]);
      }
    }
    try {
      parse_protocol_text(text, kFolder + "good/damaged.json");
    } catch (const InputError& error) {
      EXPECT_FALSE(error.faults().empty());
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(MeshFiles, StoredOnesStandInForMissingOnes) {
  const std::string text =
      R"({"version": 1, "name": "own", "renderers": ["point"], "repetitions": 1,
          "stimuli": [{"name": "wedge", "shape": "mesh", "file": "no-such-folder/wedge.obj"}],
          "response": {"keys": {"1": "wedge"}}})";
  EXPECT_THROW(parse_protocol_text(text, "own.json"), InputError);
  const Protocol kept =
      parse_protocol_text(text, "own.json", {{"no-such-folder/wedge.obj", "v 0 0 0\n"}});
  const stimuli::ObjectSpec& object = kept.stimuli.at(0).object;
  EXPECT_EQ(object.file_name, "no-such-folder/wedge.obj");
  ASSERT_TRUE(object.file_bytes);
  EXPECT_EQ(*object.file_bytes, "v 0 0 0\n");
}

}  // namespace
}  // namespace palpate::protocols
