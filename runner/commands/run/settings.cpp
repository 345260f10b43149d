#include "runner/commands/run/settings.h"

#include <algorithm>
#include <cmath>

#include "data/record.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/study_options.h"

namespace palpate::runner::commands {

namespace po = boost::program_options;

void add_device_options(po::options_description& options, station::RunSettings& settings) {
  options.add_options()  //
      ("serial", po::value(&settings.serials)->composing()->value_name("NUMBER"),
       "which device; two of a stylus: twice, tip first")  //
      ("firmware", po::value(&settings.firmware)->value_name("FILE"),
       "uploaded where the device needs it")  //
      ("library", po::value(&settings.library)->value_name("FILE"),
       "the maker's library, where --device is reached through one; default: looked for")  //
      ("service", po::value(&settings.service)->value_name("HOST:PORT"),
       "the maker's program, where --device is reached through one; default: its own port here")  //
      ("calibration", po::value(&settings.calibration)->value_name("FILE"),
       "what 'palpate devices --calibrate' stored")  //
      ("without-calibration", po::bool_switch(&settings.without_calibration),
       "run although the calibration is missing or stale");
}

void add_recorder_options(po::options_description& options, station::RunSettings& settings) {
  options.add_options()  //
      ("markers", po::value(&settings.markers)->composing()->value_name("WHERE"),
       "udp:HOST:PORT, serial:PATH[:BAUD[:PULSE_MS]], parport:PATH[:PULSE_MS] or lsl[:NAME]; may "
       "be given several times; 'palpate devices --markers WHERE' tries it. Their bytes: the "
       "protocol's codes")  //
      ("sync", po::bool_switch(&settings.sync),
       "send the marker sync (128: a parallel port's highest data line) once a second to what "
       "--markers names")  //
      ("stream", po::value(&settings.stream)->value_name("lsl[:NAME]"),
       "send every tick of a trial, 20 channels of pose and force, to Lab Streaming Layer, where "
       "liblsl is installed; anyone on the network can listen")  //
      ("marker-codes", po::bool_switch(&settings.marker_codes),
       "markers that leave this computer (udp to another one, lsl) carry the participant's code, "
       "in clear; without it participant_id is null there");
}

void add_sound_options(po::options_description& options, station::RunSettings& settings) {
  options.add_options()  //
      ("sound-device",
       po::value(&settings.sound_device)->default_value("default")->value_name("NAME"),
       "ALSA device of the headphones, where the protocol has masking noise or sounds; "
       "palpate devices --sound measures how late it is")  //
      ("without-noise", po::bool_switch(&settings.without_noise),
       "run without the protocol's masking noise and sounds");
}

void check_recorders(const station::RunSettings& settings) {
  if (settings.sync && settings.markers.empty())
    throw UsageError("--sync: name a receiver with --markers");
}

namespace {

/// Checks a language code: it becomes part of a file's name.
void check_language(const std::string& language) {
  const bool letters = std::all_of(language.begin(), language.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  });
  if (!letters || language.size() > 32)
    throw UsageError("--language: must be letters, digits, - and _, such as de or pt-BR");
}

void check(station::RunSettings& settings) {
  settings.participant = given_or_asked(settings.participant, "participant code");
  if (!data::is_participant_code(settings.participant))
    throw UsageError("--participant: must be a pseudonym of 1 to 32 letters and digits");
  if (settings.number && *settings.number < 1) throw UsageError("--number: must be 1 or more");
  const std::string& changed = settings.changed_protocol;
  if (!changed.empty() && changed != "stored" && changed != "texts")
    throw UsageError("--changed-protocol: must be stored or texts");
  if (settings.session && *settings.session < 1) throw UsageError("--session: must be 1 or more");
  if (!settings.hand.empty() && settings.hand != "left" && settings.hand != "right")
    throw UsageError("--hand: must be left or right");
  if (settings.response_latency &&
      !(std::isfinite(*settings.response_latency) && *settings.response_latency >= 0))
    throw UsageError("--response-latency: must be 0 or more seconds");
  check_advisor(settings.advisor, settings.advisor_time_out);
  if (settings.spoken && settings.buttons)
    throw UsageError("--spoken: the experimenter types the answers; leave out --buttons");
  check_language(settings.language);
  check_recorders(settings);
  if (settings.device == "mouse" && settings.no_window)
    throw UsageError("--device mouse needs the window: leave out --no-window");
}

}  // namespace

std::optional<station::RunSettings> parse_run_settings(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate run PROTOCOL.json --db FILE --participant CODE [--number N] --device NAME";
  line.summary =
      "A live session: resumes an unfinished one, else begins the next. Every trial is on disk\n"
      "before the next one starts. The participant answers with the protocol's keys; Escape or\n"
      "F12 turns the forces off (emergency). 'palpate devices' lists the devices. A new\n"
      "participant is enrolled with the first answer, note or trial; palpate asks first if the\n"
      "code is not in the database.";
  line.example =
      R"(  palpate run protocols/ho2000.json --db study.db --participant P03 --device falcon2 --hand right --consent 2024-05
  palpate run protocols/quick.json --db try.db --participant T1 --device mouse
  palpate run protocols/quick.json --db try.db --participant T2 --device simulated --no-window
)";
  station::RunSettings settings;
  int number = 0, session = 0;
  double latency = 0, scale = 0;
  line.options.add_options()  //
      ("db", po::value(&settings.database)->required()->value_name("FILE"),
       "database; created or resumed")  //
      ("participant", po::value(&settings.participant)->required()->value_name("CODE"),
       "pseudonym, 1 to 32 letters and digits; -: ask for it, or read a line of standard input, to "
       "hide it from other users of this computer")  //
      ("new-participant", po::bool_switch(&settings.new_participant),
       "CODE is a new participant: do not ask, even if it resembles another code")  //
      ("after-withdrawal", po::bool_switch(&settings.after_withdrawal),
       "CODE has withdrawn and asks to take part again; recorded")  //
      ("number", po::value(&number)->value_name("N"),
       "orders the counterbalancing; default: the next unused one")  //
      ("group", po::value(&settings.group)->value_name("NAME"),
       "group of a new participant, where the protocol leaves it to you")  //
      ("fill", po::bool_switch(&settings.fill),
       "a new participant gets the group that the fewest have completed; recorded")  //
      ("changed-protocol", po::value(&settings.changed_protocol)->value_name("stored|texts"),
       "if the protocol has changed since CODE began: stored (the default) keeps the old one; "
       "texts "
       "takes new texts if nothing else differs; without the option you are asked on a terminal")  //
      ("device", po::value(&settings.device)->required()->value_name("NAME"),
       "a kind of device (palpate devices lists them)")  //
      ("ask", po::value(&settings.advisor)->value_name("SOCKET"),
       "Unix domain socket of a program that proposes the levels of adaptive blocks")  //
      ("ask-time-out-s",
       po::value(&settings.advisor_time_out)->default_value(1, "1")->value_name("S"),
       "after this time without an answer the block's own procedure chooses; recorded")  //
      ("session", po::value(&session)->value_name("N"),
       "default: the first that is not completed")  //
      ("consent", po::value(&settings.consent)->value_name("VERSION"),
       "the consent that was given: version of its text; recorded with the time")           //
      ("hand", po::value(&settings.hand)->value_name("left|right"), "hand used; recorded")  //
      ("buttons", po::bool_switch(&settings.buttons),
       "the device's buttons answer, in the order of the protocol's keys")  //
      ("spoken", po::bool_switch(&settings.spoken),
       "the participant says the answers, the experimenter types them: in the console's field, or "
       "':answer X'")  //
      ("response-box", po::value(&settings.response_box)->value_name("PATH[:BAUD]"),
       "serial port of a box whose bytes are keys (9600 baud, 8N1), as the protocol's responses "
       "say; beside the keyboard")  //
      ("language", po::value(&settings.language)->value_name("CODE"),
       "show the texts of NAME.texts.CODE.json, or texts.CODE.json, beside the protocol")  //
      ("response-latency", po::value(&latency)->value_name("SECONDS"),
       "of keyboard or buttons, where it was measured; recorded, never subtracted");
  add_recorder_options(line.options, settings);
  line.options.add_options()                                            //
      ("no-window", po::bool_switch(&settings.no_window), "text only")  //
      ("full-screen", po::bool_switch(&settings.full_screen),
       "the participant's window, on a monitor of its own")  //
      ("participant-monitor", po::value(&settings.participant_monitor)->value_name("N"),
       "from 1")                                                                            //
      ("console-monitor", po::value(&settings.console_monitor)->value_name("N"), "from 1")  //
      ("ui-scale", po::value(&scale)->value_name("FACTOR"),
       "of letters and buttons, 0.5 to 4; default: from each window's monitor");
  add_device_options(line.options, settings);
  add_sound_options(line.options, settings);
  line.positional_names = {"PROTOCOL.json"};
  const auto values = line.parse(args);
  if (!values) return std::nullopt;
  settings.protocol = (*values)["PROTOCOL.json"].as<std::string>();
  if (values->count("response-box") > 0 && settings.response_box.empty())
    throw UsageError("--response-box: expected PATH[:BAUD] of a serial port");
  if (values->count("number") > 0) settings.number = number;
  if (values->count("session") > 0) settings.session = session;
  if (values->count("response-latency") > 0) settings.response_latency = latency;
  for (const char* option : {"participant-monitor", "console-monitor"}) {
    if (values->count(option) > 0 && (*values)[option].as<int>() < 1)
      throw UsageError(std::string("--") + option +
                       ": must be 1 or more, as monitors count from 1");
  }
  if (values->count("ui-scale") > 0) {
    if (!(scale >= 0.5 && scale <= 4)) throw UsageError("--ui-scale: must be 0.5 to 4");
    settings.ui_scale = scale;
  }
  check(settings);
  return settings;
}

}  // namespace palpate::runner::commands
