#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>

#include "data/base/text.h"
#include "data/files/atomic_file.h"
#include "data/store/store.h"
#include "protocols/fault_list.h"
#include "protocols/json_document.h"
#include "protocols/session_plan.h"
#include "runner/commands/run/settings.h"
#include "runner/commands/shared/command.h"
#include "runner/safety/fault_signals.h"
#include "runner/serve/loopback.h"
#include "runner/serve/network.h"
#include "runner/serve/served_scene.h"
#include "runner/serve/served_session.h"
#include "runner/servo/realtime.h"
#include "runner/session/device_check.h"
#include "runner/session/recorded_outcome.h"
#include "runner/station/admission.h"
#include "runner/station/lag_check.h"
#include "runner/station/opening.h"
#include "runner/touch/forces.h"
#include "runner/touch/trial_page.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

/// Surfaces in the world, for watchers.
std::string picture_of(const std::vector<stimuli::ObjectSpec>& objects) {
  constexpr std::size_t kMostTriangles = 6000;  // of all
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const stimuli::ObjectSpec& object : objects) {
    const touch::PictureMesh mesh =
        touch::picture_mesh(object, kMostTriangles / objects.size() + 1);
    nlohmann::ordered_json corners = nlohmann::ordered_json::array();
    for (const Vec3& corner : mesh.corners) {
      const Vec3 p = object.pose.position + object.pose.orientation * corner;
      corners.push_back(
          {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
    }
    out.push_back({{"corners", std::move(corners)}, {"triangles", mesh.triangles}});
  }
  return "\"objects\":" + out.dump();
}

/// The file with the token while the server runs; only its owner can read it. Replaces no file but
/// one that a server left behind.
class TokenFile {
 public:
  /// \param port  of this server
  TokenFile(std::string path, std::uint16_t port, const std::string& text)
      : path_(std::move(path)) {
    if (path_.empty()) return;
    data::AtomicFile file(path_);
    file.write(text + "\n");
    file.sync();
    const bool left_behind = is_left_behind(path_, port);
    if (!left_behind && std::filesystem::exists(path_))
      throw UsageError("--token-file: " + printable(path_) +
                       " exists and holds no token; name another file");
    file.commit(left_behind);
    ::fstat(file.descriptor(), &file_);
    path_ = std::filesystem::canonical(path_).string();
    written_ = true;
  }
  ~TokenFile() {
    struct stat found {};  // another server's, if somebody removed this one
    if (written_ && ::lstat(path_.c_str(), &found) == 0 && found.st_dev == file_.st_dev &&
        found.st_ino == file_.st_ino)
      ::unlink(path_.c_str());
  }
  TokenFile(const TokenFile&) = delete;
  TokenFile& operator=(const TokenFile&) = delete;

 private:
  /// \throws UsageError: its server still runs
  static bool is_left_behind(const std::string& path, std::uint16_t own) {
    std::error_code none;  // reading from a pipe would wait for its writer
    if (!std::filesystem::is_regular_file(path, none)) return false;
    constexpr std::string_view kStart = R"({"type":"serving","url":"ws://127.0.0.1:)";
    std::ifstream file(path, std::ios::binary);
    std::string start(kStart.size(), '\0');
    if (!file.read(start.data(), static_cast<std::streamsize>(start.size())) || start != kStart)
      return false;
    std::uint16_t port = 0;
    if (file >> port && port != own && serve::is_listening(port))
      throw UsageError("--token-file: " + printable(path) +
                       " belongs to a server that runs; end it, or name another file");
    return true;
  }

  std::string path_;
  struct stat file_ {};
  bool written_ = false;
};

/// Lines typed at the server's terminal. Never waits. In the background it reads nothing, which
/// would stop the program.
std::string typed_now() {
  const pid_t in_front = ::tcgetpgrp(STDIN_FILENO);  // -1: not the terminal that controls it
  if (::isatty(STDIN_FILENO) == 0 || (in_front >= 0 && in_front != ::getpgrp())) return "";
  pollfd input{STDIN_FILENO, POLLIN, 0};
  std::array<char, 256> text;
  if (::poll(&input, 1, 0) <= 0 || (input.revents & POLLIN) == 0) return "";
  const ssize_t size = ::read(STDIN_FILENO, text.data(), text.size());
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "";
}

/// The scene's or session's thread beside the network's: what both kinds of server have. Replies
/// to the person at its terminal go to standard error.
class Server final : public serve::ServeOutput {
 public:
  Server(const po::variables_map& values, safety::FaultSignals& signals)
      : values_(values), signals_(signals), network_(settings_of(values)) {}
  ~Server() override {
    network_.end();  // first: it calls the served object
    signals_.watch(static_cast<servo::ServoThread*>(nullptr));
    signals_.watch(static_cast<safety::GuardedDevice*>(nullptr));
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  void reply(std::uint64_t client, std::string text) override {
    if (client != serve::Emergencies::kHere) return network_.reply(client, std::move(text));
    protocols::FaultList none("reply");
    const nlohmann::json said = protocols::read_json(text, none);
    std::cerr << (said["ok"] ? "cleared" : said["error"]["message"].get<std::string>())
              << std::endl;
  }
  void tell(std::string text) override { network_.tell(std::move(text)); }

  /// Commands of clients, and of the person at the terminal.
  std::vector<serve::ServeCommand> commands() {
    std::vector<serve::ServeCommand> out = network_.commands();
    if (typed_now() != "clear\n") return out;
    serve::Message clear;
    clear.type = serve::MessageType::clear;
    clear.times_off = times_off_();
    out.push_back({serve::Emergencies::kHere, false, std::move(clear), false});
    return out;
  }
  /// Prints the address and starts answering. \param served  a ServedScene or ServedSession
  template <class Served>
  void begin(Served& served, servo::ServoThread& servo) {
    signals_.watch(&servo);
    nlohmann::ordered_json serving = {{"type", "serving"},
                                      {"url", "ws://127.0.0.1:" + std::to_string(network_.port())}};
    if (const std::string socket = text_of(values_, "socket"); !socket.empty())
      serving["socket"] = socket;
    serving["token"] = token_;
    serving["page"] = "http://127.0.0.1:" + std::to_string(network_.port()) + "/#" + token_;
    token_file_.emplace(text_of(values_, "token-file"), network_.port(), serving.dump());
    times_off_ = [&served] { return served.times_off(); };
    network_.begin(
        {.emergency =
             [&served](std::uint64_t client) {
               const bool first = served.emergency(client);
               if (first)
                 std::cerr << "emergency by client " << client
                           << ": forces are off until it clears them, or the word clear "
                              "is typed here\n";
               return first;
             },
         .has_emergency =
             [&served](std::uint64_t client) { return served.emergencies().raised_by(client); },
         .zero = [&served] { served.emergency_zero(); },
         .silence = [&served] { served.controller_is_silent(); },
         .forces_are_on = [&servo] { return !servo.forces_are_off(); },
         .forces_may_come = [&served] { return served.forces_may_come(); },
         .times_off = times_off_,
         .state = [&served] { return served.state(); },
         .picture = [&served] { return served.picture(); },
         .ticks = &served.ticks(),
         .wake = [&servo] { servo.bell().ring(); }});
    // The token is in the file, where one is asked for: not in a log as well.
    if (values_.count("token-file") > 0) {
      serving.erase("token");
      serving.erase("page");
    }
    std::cout << serving.dump() << std::endl;
    if (!std::cout) throw std::runtime_error("standard output could not be written");
  }

 private:
  serve::NetworkSettings settings_of(const po::variables_map& values) {
    token_ = serve::make_token();
    serve::NetworkSettings net{.port = static_cast<std::uint16_t>(values["port"].as<int>()),
                               .socket = text_of(values, "socket"),
                               .token = token_,
                               .origins = {},
                               .page = std::string(touch::live_page())};
    if (values.count("allow-origin") > 0)
      net.origins = values["allow-origin"].as<std::vector<std::string>>();
    return net;
  }

  const po::variables_map& values_;
  safety::FaultSignals& signals_;
  std::string token_;
  std::function<std::uint32_t()> times_off_;
  serve::Network network_;
  std::optional<TokenFile> token_file_;
};

void report_servo(const servo::ServoThread& servo) {
  const servo::ServoHealth& health = servo.health();
  std::cerr << "palpate serve ends: " << health.ticks() << " ticks, " << health.missed_ticks()
            << " missed\n";
}

constexpr std::int64_t kNap_ns = 2'000'000;  // between two looks at the servo's samples

/// Markers and stream of a served scene or session.
struct Recorders {
  /// \param sinks  opened before the device's watchdog is forked. \param rate  Hz, of the servo
  Recorders(std::vector<std::unique_ptr<session::MarkerSink>> sinks,
            const protocols::EventCodes& codes, const station::RunSettings& settings, double rate)
      : markers(std::move(sinks), codes, settings.sync),
        stream(station::open_stream(settings, rate)) {}
  ~Recorders() { station::print_dropped(markers, stream.get()); }
  Recorders(const Recorders&) = delete;
  Recorders& operator=(const Recorders&) = delete;

  session::Markers markers;
  std::unique_ptr<session::SampleStream> stream;
};

int serve_scene(const po::variables_map& values, const station::RunSettings& run) {
  const devices::DeviceKind& kind = station::find_device_kind(run.device);
  const std::string path = text_of(values, "scene");
  protocols::SceneSpec spec;
  std::string text;
  if (!path.empty()) {
    text = protocols::read_scene_text(path);
    spec = protocols::parse_scene_text(text, path);
  }
  const double rate = values["rate"].as<double>();
  if (!(rate >= 100 && rate <= 4000))
    throw UsageError("--rate: expected a number from 100 to 4000");

  auto sinks = station::open_markers(run);
  safety::FaultSignals signals;
  protocols::Protocol protocol = serve::protocol_of(spec, touch::renderer_named("point"));
  protocol.servo_rate = rate;
  const station::OpenDevice open =
      station::open_device(kind, run, protocol);  // forks: before there are threads
  signals.watch(open.guard);
  Recorders recorders(std::move(sinks), protocols::usual_event_codes(), run, rate);
  if (open.guard != nullptr) station::check_fitness(open, run, protocol, StimulusLibrary(protocol));
  servo::RealClock clock;
  servo::ServoSettings servo;
  servo.rate = protocol.servo_rate;
  servo.workspace = workspace_of(protocol);
  serve::ServedScene scene(*open.device, open.guard, clock,
                           {.scene_path = path.empty() ? "scene" : path,
                            .scene = text,
                            .servo = servo,
                            .picture = picture_of,
                            .markers = &recorders.markers,
                            .stream = recorders.stream.get()});
  Server server(values, signals);
  scene.answer_through(server);
  scene.give_up_when([&signals] { return signals.end_requested() != 0; });
  server.begin(scene, scene.servo());
  try {
    while (signals.end_requested() == 0) {
      for (const serve::ServeCommand& command : server.commands()) {
        if (command.left)
          scene.controller_left();
        else
          scene.obey(command.client, command.message);
      }
      scene.attend();
      scene.servo().bell().wait(kNap_ns);
    }
  } catch (const session::EndOfSession& end) {
    scene.emergency_zero();
    std::cerr << end.what() << "\n";
    return 1;
  }
  scene.emergency_zero();
  report_servo(scene.servo());
  return 0;
}

int serve_session(const station::RunSettings& settings, const po::variables_map& values) {
  const devices::DeviceKind& kind = station::find_device_kind(settings.device);
  station::Admission admission = station::admit(settings);
  protocols::Protocol protocol = admission.protocol;
  if (const std::string why = serve::unserved(protocol); !why.empty())
    throw UsageError("--protocol: " + why);

  auto sinks = station::open_markers(settings);
  safety::FaultSignals signals;
  const station::OpenDevice open =
      station::open_device(kind, settings, protocol);  // forks: before there are threads
  signals.watch(open.guard);
  const servo::DeviceCapabilities& device = open.device->capabilities();
  const std::vector<session::LimitedMaterial> limited = session::limit_materials(protocol, device);
  const StimulusLibrary library(protocol);
  station::check_fitness(open, settings, protocol, library);
  Recorders recorders(std::move(sinks), protocols::event_codes(protocol), settings,
                      protocol.servo_rate);
  servo::HeardTicks heard(station::kHeardTicks);
  const auto sound = station::open_sound(settings, protocol, heard);

  data::Store store = data::Store::open(settings.database, data::Store::Mode::write_or_create);
  warn_of_exposure(store.path());
  if (std::string note = station::check_sound_lag(store, protocol, settings); !note.empty())
    admission.notes.push_back(std::move(note));
  servo::RealClock clock;
  const data::Participant participant =
      store.look_up(admission.enrolled, admission.participant, admission.number, device.simulated);
  const int session = station::choose_session(store, participant, protocol, settings);
  // Standard output is the program's.
  std::cerr << "participant " << participant.code << ", session " << session << "\n";
  const data::ClockStamp began = station::stamp_now(clock);
  data::RunInfo info = station::run_info(settings, device, session, began, false);
  info.response_device = "another program";
  session::RunRecord record(store, admission.enrolled, participant, info,
                            station::other_texts(admission));
  const data::SessionProgress progress = store.progress(participant, session);
  protocols::SessionPlan plan(protocol, participant.enrolled_number, session);
  for (const data::TrialRecord& trial : progress.completed)
    plan.answered(session::outcome_of(trial));
  if (const std::string resumed = station::resumption(store, participant, session, plan);
      !resumed.empty())
    std::cerr << resumed << "\n";

  record.note(clock.now_ns(), R"({"served":{"preflight":"left out"}})");
  if (sound == nullptr && station::has_sound(protocol))
    std::cerr << "WITHOUT the protocol's masking noise and sounds\n";
  for (const std::string& note : station::notes_on_outlets(settings, protocol, sound.get()))
    record.note(clock.now_ns(), note);
  for (const std::string& note : admission.notes) record.note(clock.now_ns(), note);
  if (!limited.empty())
    record.note(clock.now_ns(), session::to_json_text(limited, device, protocol.servo_rate));
  servo::ServoSettings servo_settings = station::servo_settings_of(protocol);
  if (station::has_contact_sound(protocol)) servo_settings.heard = &heard;
  servo::ServoThread servo(*open.device, clock, servo_settings);
  std::optional<session::StreamedServo> streamed;
  if (recorders.stream) streamed.emplace(servo, *recorders.stream);
  servo::TickSource& ticks = streamed ? static_cast<servo::TickSource&>(*streamed) : servo;
  const session::Station station{protocol, library, plan,    ticks,      clock,
                                 began,    record,  nullptr, sound.get()};
  serve::ServedSession served({.station = station,
                               .record = record,
                               .servo = servo,
                               .guard = open.guard,
                               .markers = recorders.markers,
                               .end_requested = [&signals] { return signals.end_requested(); },
                               .stored = progress.completed,
                               .picture = picture_of});
  Server server(values, signals);
  server.begin(served, servo);
  const serve::ServedSession::Outcome outcome =
      served.run(server, [&server] { return server.commands(); });
  served.emergency_zero();
  report_servo(servo);
  if (!outcome.reason.empty()) std::cerr << outcome.reason << "\n";
  return outcome.failed ? 1 : 0;
}

int serve(const po::variables_map& values, station::RunSettings run) {
  run.device = text_of(values, "device");
  check_recorders(run);
  const int port = values["port"].as<int>();
  if (port < 0 || port > 65535) throw UsageError("--port: expected a number from 0 to 65535");
  const bool recorded = values.count("protocol") > 0;
  for (const char* const option : {"db", "participant"}) {
    if ((values.count(option) > 0) != recorded)
      throw UsageError("expected --protocol, --db and --participant together, or none of them");
  }
  for (const char* const option : {"number", "group", "session", "consent"}) {
    if (values.count(option) > 0 && !recorded)
      throw UsageError(std::string("--") + option + ": requires --protocol");
  }
  for (const char* const option : {"sound-device", "without-noise"}) {
    if (!recorded && !values[option].defaulted())
      throw UsageError(std::string("--") + option + ": requires --protocol, which has the sounds");
  }
  if (!recorded) return serve_scene(values, run);
  if (values.count("scene") > 0 || !values["rate"].defaulted())
    throw UsageError("--protocol: it has stimuli and a servo rate; leave --scene and --rate out");
  run.protocol = text_of(values, "protocol");
  run.database = text_of(values, "db");
  run.participant = text_of(values, "participant");
  run.consent = text_of(values, "consent");
  if (values.count("number") > 0) run.number = values["number"].as<int>();
  if (values.count("session") > 0) run.session = values["session"].as<int>();
  run.new_participant = values["new-participant"].as<bool>();
  run.group = text_of(values, "group");
  run.fill = values["fill"].as<bool>();
  if (run.fill && !recorded) throw UsageError("--fill: requires --protocol");
  run.no_window = true;
  return serve_session(run, values);
}

}  // namespace

int serve_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate serve --device NAME [--scene SCENE.json] [--port N] [--socket PATH]\n"
      "              [--token-file FILE] [--allow-origin URL ...]\n"
      "palpate serve --device NAME --protocol P.json --db FILE --participant CODE ...";
  line.summary =
      "Serves scenes to another program: messages in JSON over a WebSocket of 127.0.0.1, or a\n"
      "line each over a Unix socket (protocols/serve.schema.json). The program chooses scenes and\n"
      "their times; palpate renders, limits and guards the forces. They end if the program\n"
      "disconnects or is silent for 0.5 s. Ctrl-C ends serving. With a protocol it is a recorded\n"
      "session: the program begins each trial and gives the answer, and in blocks of the task\n"
      "'external' chooses the stimuli.";
  line.example =
      "  palpate serve --device simulated --scene scene.json\n"
      "  palpate serve --device inverse3 --socket /run/user/1000/palpate --token-file token.json\n"
      "  palpate serve --device simulated --port 7000 --allow-origin http://localhost:8000\n"
      "  palpate serve --device simulated --protocol p.json --db study.db --participant P03\n";
  line.options.add_options()  //
      ("device", po::value<std::string>()->value_name("NAME")->required(),
       "as for palpate run")  //
      ("scene", po::value<std::string>()->value_name("FILE"),
       "the first scene; without it the client loads one")  //
      ("protocol", po::value<std::string>()->value_name("FILE"),
       "whose trials are shown and recorded")                                                 //
      ("db", po::value<std::string>()->value_name("FILE"), "the record, as for palpate run")  //
      ("participant", po::value<std::string>()->value_name("CODE"), "as for palpate run")     //
      ("number", po::value<int>()->value_name("N"), "as for palpate run")                     //
      ("group", po::value<std::string>()->value_name("NAME"), "as for palpate run")           //
      ("fill", po::bool_switch(), "as for palpate run")                                       //
      ("session", po::value<int>()->value_name("N"), "as for palpate run")                    //
      ("new-participant", po::bool_switch(), "as for palpate run")                            //
      ("consent", po::value<std::string>()->value_name("VERSION"), "as for palpate run")      //
      ("port", po::value<int>()->value_name("N")->default_value(0),
       "of 127.0.0.1; 0: one that is free")  //
      ("socket", po::value<std::string>()->value_name("PATH"),
       "also serve the same messages, a line each, on this Unix socket")  //
      ("token-file", po::value<std::string>()->value_name("FILE"),
       "write address and token there, for its owner alone, instead of the token to standard "
       "output; removed at the end")  //
      ("allow-origin", po::value<std::vector<std::string>>()->value_name("URL"),
       "pages from there may connect; repeatable")  //
      ("rate", po::value<double>()->value_name("HZ")->default_value(1000, "1000"),
       "of the servo; with --protocol the protocol's");
  station::RunSettings settings;
  add_device_options(line.options, settings);
  add_recorder_options(line.options, settings);
  add_sound_options(line.options, settings);
  const auto values = line.parse(args);
  if (!values) return 0;
  try {
    return serve(*values, settings);
  } catch (const serve::MessageRefused& error) {  // of the first scene
    std::string reasons;
    for (const serve::Refusal& why : error.why())
      reasons += "\n" + why.place + (why.place.empty() ? "" : ": ") + why.message;
    throw UsageError("--scene: it cannot be shown on this device:" + reasons);
  }
}

}  // namespace palpate::runner::commands
