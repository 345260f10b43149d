"""Holds the sources against the plan of the house: who may include whom, which headers are a room's public face,
no cycle between files, no two types of one name in a namespace, what the renderer may not use."""

import collections
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Room: what it may include beside itself. A room's folder within a folder is a room of its own; what stands in
# the folder itself ("runner": scene_builder.h) is the base of the rooms within.
RENDERING = {"stimuli", "rendering"}
BODIES = RENDERING | {"rendering/bodies"}
SERVO = RENDERING | {"runner", "runner/servo", "rendering/bodies/soft"}
GROUND = "data/base"  # what every room may include
MAY_INCLUDE = {
    GROUND: set(),
    "stimuli": set(),
    "rendering": {"stimuli"},
    "rendering/bodies": RENDERING,
    "rendering/bodies/soft": RENDERING,
    # Stimuli are scene objects in orientations: their types, rotations and generator live there.
    "protocols": {"stimuli", "protocols/procedures"},
    # Which level comes next: pure functions of plain values.
    "protocols/procedures": {"stimuli"},
    "data": set(),
    "data/files": {"data"},
    "data/store": {"data", "data/files"},
    "data/export": {"data", "data/files", "data/store"},
    "data/merge": {"data", "data/files", "data/store"},
    "analysis": {"stimuli"},
    "analysis/input": {"analysis", "stimuli", "protocols", "data", "data/files", "data/store"},
    "analysis/statistics": {"analysis", "analysis/input", "stimuli", "protocols/procedures"},
    "analysis/movement": {"analysis", "analysis/input", "analysis/statistics", "stimuli"},
    "analysis/figures": {"analysis", "analysis/input", "analysis/statistics", "analysis/movement", "stimuli", "protocols/procedures"},
    "analysis/report": {"analysis", "analysis/input", "analysis/statistics", "analysis/movement", "analysis/figures", "protocols",
                        "protocols/procedures"},
    "runner": BODIES | {"protocols", "rendering/bodies/soft"},
    "runner/servo": RENDERING | {"runner", "rendering/bodies/soft"},
    "runner/safety": SERVO,
    "runner/sound": RENDERING | {"protocols", "data", "runner/servo"},
    "runner/devices": SERVO | {"protocols", "data", "data/files", "runner/devices/falcon"},
    "runner/devices/falcon": SERVO | {"protocols"},
    "runner/display": SERVO | {"protocols", "runner/devices", "runner/safety", "runner/display/scene"},
    "runner/display/scene": SERVO,
    "runner/participants": SERVO | {"protocols", "data", "runner/devices", "runner/display"},
    "runner/session": SERVO | {"protocols", "data", "data/files", "data/store", "runner/safety", "runner/devices",
                               "runner/display", "runner/participants", "runner/sound"},
    # From plan to archive.
    "runner/registration": SERVO | {"protocols", "protocols/procedures", "data", "data/files", "data/store", "data/export", "analysis",
                                    "analysis/figures", "analysis/input", "analysis/report", "analysis/statistics", "runner/participants",
                                    "runner/session", "runner/study"},
    "runner/study": SERVO | {"protocols", "protocols/procedures", "data", "data/store", "data/export", "analysis", "analysis/figures",
                             "analysis/input", "analysis/report", "analysis/statistics", "runner/output", "runner/participants", "runner/safety",
                             "runner/session"},
    "runner/serve": SERVO | {"protocols", "runner/safety", "runner/session"},
    # A page to write a protocol.
    "runner/design": SERVO | {"protocols", "data", "data/files", "data/store", "analysis", "analysis/input", "analysis/report",
                              "analysis/statistics", "runner/participants", "runner/serve", "runner/session", "runner/station",
                              "runner/study", "runner/touch"},
    "runner/sweep": SERVO | {"protocols", "data", "data/files", "data/store", "analysis/input", "analysis/statistics", "runner/output",
                            "runner/participants", "runner/session"},
    "runner/output": {"stimuli", "data", "data/files", "runner"},
    # Who takes part, with what.
    "runner/station": SERVO | {"protocols", "data", "data/files", "data/store", "runner/safety", "runner/devices", "runner/display",
                               "runner/participants", "runner/session", "runner/sound", "runner/study"},
    "runner/touch": SERVO | {"protocols", "data", "data/files", "data/store", "analysis", "analysis/figures", "analysis/input",
                             "analysis/report", "runner/safety", "runner/output", "runner/session", "runner/display",
                             "runner/display/scene", "runner/serve", "runner/station"},
    "runner/movement": SERVO | {"protocols", "data", "data/store", "data/export", "analysis/input", "analysis/movement",
                                "runner/output", "runner/session", "runner/study"},
    "runner/evidence": set(),
    "runner/evidence/verification": RENDERING,
    "runner/evidence/accuracy": BODIES | {"runner/evidence/verification", "rendering/bodies/soft"},
    "runner/evidence/scenes": BODIES | {"protocols", "rendering/bodies/soft", "runner", "runner/evidence", "runner/evidence/accuracy",
                               "runner/evidence/verification", "runner/touch"},
    "runner/evidence/stability": SERVO | {"protocols", "rendering/bodies", "runner/devices", "runner/evidence/verification", "runner/touch"},
    "runner/evidence/reports": SERVO | {"runner/evidence/accuracy", "runner/evidence/scenes", "runner/evidence/stability", "runner/evidence/verification", "analysis",
                                         "analysis/figures", "analysis/report", "analysis/statistics"},
}
# The commands, the Python module and main() may include everything.
EVERYTHING = ("runner/commands", "runner/main.cpp", "runner/python")
# Rooms whose every header is for everybody: small types that all of the program is made of.
OPEN_ROOMS = {"stimuli", "protocols", "data", "analysis", "runner"}
# rendering/ is pure: no device, clock, thread, file or global.
IMPURE = re.compile(r"<(chrono|thread|mutex|atomic|fstream|iostream|filesystem|cstdio|ctime|random)>")


def includes(path):
    return re.findall(r'^\s*#\s*include\s+["<]([^">]+)[">]', path.read_text(), re.M)


TOP = sorted({room.split("/")[0] for room in MAY_INCLUDE})
SOURCES = {path.relative_to(ROOT).as_posix(): path for top in TOP for path in sorted((ROOT / top).rglob("*"))
           if path.suffix in (".h", ".cpp")}
INCLUDES = {name: includes(path) for name, path in SOURCES.items()}


def room_of(name):
    """The innermost room that a file lies in."""
    folder = name.rpartition("/")[0]
    while folder not in MAY_INCLUDE and folder not in EVERYTHING:
        assert folder, f"{name} lies in no room of this table"
        folder = folder.rpartition("/")[0]
    return folder

# What verifies the renderer takes it apart: these see its every header.
LOOKS_INSIDE = {"runner/evidence/accuracy", "runner/evidence/scenes", "runner/evidence/verification"}
# The headers of a room that other rooms use; all others are the room's own business (and that of the rooms within).
PUBLIC = {
    "stimuli": "bounding_tree closed_surface face_triangles shapes convex_mesh grid_hull inset large_array layers/layer_surface mesh_file nearest_on_triangle orientation polygon_soup "
               " parts/convex_parts primitives signed_distance solids/gmsh_file solids/solid_mesh solids/sparse_factor "
               "surfaces/collision_surface surfaces/direction_cells surfaces/mass_properties surfaces/support_map surfaces/surface surfaces/surface_search texture vec",
    "rendering": "fields first_contact probe reach render_fault renderer scene scene_motion tool",
    "rendering/bodies": "moving_scene",
    "runner/evidence/verification": "explain extreme_cases random_draws random_solids reference search surface_reference surface_stroke union_cases union_search",
    "runner/evidence/scenes": "feature_costs scene_study stage_costs tick_costs",
    "runner/evidence/accuracy": "body_study methods paper_first_contact peers study union_study",
    "rendering/bodies/soft": "segment_triangle soft_build soft_contact soft_object soft_scene",
    "protocols": "answer_keys difference event_codes factors fault_list groups json_document object_reader parse protocol scene_spec schedule session_plan sight sound sweep_space "
                 "tasks/block_order tasks/block_procedures tasks/levels tasks/texts",
    "protocols/procedures": "procedure procedure_spec psychometric recovery",
    "data/base": "base64 cell_name checksum column_names group_assignment input_file json_text markdown random sobol text utf8 words",
    "data": "column_table record stored_protocol sweep_record",
    "data/files": "atomic_file atomic_folder file_permissions text_sink output_check utc",
    "data/store": "export_log frames unmaskings participant_columns participant_groups protocol_rows schema statement station_database store store_error sweep_file "
                  "forget task_text",
    "data/export": "csv datasets sample_slots settings study_about trial_table",
    "data/merge": "merge",
    "analysis": "text",
    "analysis/input": "csv_reader trials study_record study_table sweep_table",
    "analysis/statistics": "analysis answer_model comparison conclusions cue_plan cue_study cues describe group_power group_simulation interval_coverage jobs mixed_model "
                           "paired paired_evidence pattern pilot power plan quantiles sensitivity sequential_looks "
                           "study_design sweep_analysis task_analysis threshold_plan",
    "analysis/movement": "comparison measures pictures",
    "analysis/figures": "panel_drawing figures svg",
    "analysis/report": "coverage_report cue_report html_page hypotheses plan_record plan_report report study_report tables",
    "runner": "",
    "runner/servo": "device field_demand force_limiter heard_tick passivity realtime ring sample servo servo_thread "
                    "shared_value tick_source touched_places triple_buffer",
    "runner/safety": "fault_signals guarded_device shared_memory",
    "runner/sound": "loopback player sound_output sound_source",
    "runner/devices": "device_delay mouse registry self_test simulated",
    "runner/devices/falcon": "calibration driver falcon stylus_from_ends",
    "runner/display": "display explore_window mailbox seen text_display timeline window",
    "runner/display/scene": "camera gl_objects picture drawn_mesh image_file painter scene_drawing "
                            "scene_renderer",
    "runner/participants": "keyboard reacher respondent response_box seen_record seen_trial simulated_settings simulated "
                           "task_participant",
    "runner/session": "device_check effect_check live_forces live_session markers recorded_outcome sample_stream session_scenes signals "
                      "preflight recorded_trial replay replay_comparison run_record session session_end simulated_study "
                      "socket_advisor station",
    "runner/output": "outputs progress_line",
    "runner/station": "admission lag_check opening protocol_check protocol_choice run_settings servo_timing sound_timing",
    "runner/touch": "checked_meshes forces live_touch scene_notes trial_page",
    "runner/movement": "movement_study touched_trial",
    "runner/evidence/reports": "accuracy_report boundary_report scene_report stability_report stability_study",
    "runner/registration": "about_file answers bundle_contents deviations planned_conditions planned_studies registration registration_text sealed_folder",
    "runner/study": "cue_study duration export_settings schedule_text simulation_limits study_order study_trials task_words",
    "runner/serve": "loopback network page_server served_scene served_session",
    "runner/design": "design_page protocol_file rehearsal",
    "runner/sweep": "cluster_folder cluster_job planned_sweep slurm",
    "runner/evidence/stability": "boundary effect_stability integrators scene_boundary soft_rest",
    "runner/evidence": "",
    "runner/commands": "shared/command",
}


def within(room, outer):
    return room == outer or room.startswith(outer + "/")


def is_declaration(path, opened):
    """Whether a namespace is opened only to declare another room's class."""
    return re.search(rf"^namespace {opened} \{{\n((class|struct) \w+;\n)+\}}", path.read_text(), re.M) is not None


def types_of(text):
    """Qualified names of the types that a source defines in named namespaces."""
    text = re.sub(r'//.*|/\*.*?\*/|^\s*#.*|R"(\w*)\(.*?\)\1"|"(\\.|[^"\\\n])*"|\'(\\.|[^\'\\\n])\'', "", text, flags=re.M)
    scopes, head = [], ""  # names of the open braces' namespaces; None: a body
    for piece in re.split(r"([{};])", text):
        if piece == "{":
            if opened := re.search(r"\bnamespace\s*([\w:]*)\s*$", head):
                scopes.append(opened[1] or None)
            else:
                defined = re.search(r"(?:^|>|\s)(?:class|struct|union|enum(?: class)?) (\w+(?:::\w+)*)(?: final)?\s*( :[^()=]*)?$",
                                    head)
                if defined and None not in scopes:
                    yield "::".join(scopes + [defined[1]])
                scopes.append(None)
        elif piece == "}":
            scopes.pop()
        head = "" if piece in "{};" and piece else piece


CODE = re.compile(r'//.*|/\*.*?\*/|^\s*#.*|R"(\w*)\(.*?\)\1"|"(\\.|[^"\\\n])*"|\'(\\.|[^\'\\\n])\'', re.M)


def names_in(text):
    """(namespace, whether it is without a name, name) of functions and constants outside of classes and functions."""
    scopes, head = [], ""  # of the open braces: namespaces, "": one without a name, None: a body
    for piece in re.split(r"([{};])", CODE.sub("", text)):
        if piece in ("{", ";") and None not in scopes:
            place = "::".join(filter(None, scopes)), "" in scopes
            names = re.findall(r"\b(k[A-Z]\w*)\s*(?:\[\w*\])?\s*=", head)
            function = re.search(r"^[^(=]*?(?<![\w:~])(\w+)\(", head.strip(), re.S)
            if not names and function and not re.search(r"\b(operator|using|friend)\b", head):
                names = [function[1]]
            yield from ((*place, name) for name in names)
        if piece == "{":
            opened = re.search(r"\bnamespace\s*([\w:]*)\s*$", head)
            scopes.append(opened[1] if opened else None)
        elif piece == "}":
            scopes.pop()
        head = "" if piece in "{};" and piece else piece


class Architecture(unittest.TestCase):
    def test_includes_point_one_way(self):
        faults = []
        for name, found in INCLUDES.items():
            room = room_of(name)
            for include in found:
                if ".." in include:
                    faults.append(f"{name}: includes {include}")
                if include not in SOURCES or name.startswith(EVERYTHING):
                    continue
                target = room_of(include)
                if target not in {room, GROUND} and target not in MAY_INCLUDE[room]:
                    faults.append(f"{name}: {room}/ may not include {include}")
        self.assertEqual(faults, [])

    def test_a_room_is_entered_through_its_public_headers(self):
        faults, used = [], set()
        for name, found in INCLUDES.items():
            for include in found:
                if include not in SOURCES:
                    continue
                target = room_of(include)
                if within(room_of(name), target) and name != "runner/main.cpp":
                    continue
                if target == "rendering" and room_of(name) in LOOKS_INSIDE:
                    continue
                header = include[len(target) + 1:-len(".h")]
                used.add((target, header))
                if header not in PUBLIC[target].split():
                    faults.append(f"{name}: {include} is internal to {target}/")
        unused = {(room, header) for room, headers in PUBLIC.items() for header in headers.split()} - used
        self.assertEqual(faults, [])
        self.assertEqual(unused, set(), "listed as public, but nobody outside includes it")

    def test_each_room_has_its_namespace(self):
        # palpate itself holds what every room speaks of: the ground, and vectors.
        faults = []
        for name, path in SOURCES.items():
            common = room_of(name) == GROUND or name == "stimuli/vec.h"
            rooms = name.split("/")[:-1]
            depth = 2 if rooms[0] == "runner" and rooms[1:2] != ["python"] else 1
            expected = "palpate" if common else "palpate::" + "::".join(rooms[:depth])
            for opened in re.findall(r"^namespace (palpate[\w:]*) \{", path.read_text(), re.M):
                if opened != expected and not opened.startswith(expected + "::") and not is_declaration(path, opened):
                    faults.append(f"{name}: namespace {opened}, must be {expected}")
        self.assertEqual(faults, [])

    def test_no_two_types_of_one_name(self):
        places = collections.defaultdict(list)
        for name, path in SOURCES.items():
            for qualified in types_of(path.read_text()):
                places[qualified].append(name)
        faults = {qualified: names for qualified, names in places.items() if len(names) > 1}
        self.assertEqual(faults, {}, "one definition each: the linker takes any of them for all")

    def test_no_name_of_a_header_is_hidden(self):
        # Sources are compiled in batches: what one of them hides from the others would hide a header's name from those after it.
        declared = collections.defaultdict(set)
        for name, path in SOURCES.items():
            if name.endswith(".h"):
                for place, _, declares in names_in(path.read_text()):
                    declared[declares].add((place, name))
        faults = set()
        for name, path in SOURCES.items():
            if not name.endswith(".cpp") or name.startswith(EVERYTHING):
                continue
            for place, unnamed, hides in names_in(path.read_text()):
                faults |= {f"{name}: {hides} is a name of {header}" for outer, header in declared[hides]
                           if unnamed and within(place.replace("::", "/"), outer.replace("::", "/"))
                           and header != name[:-len("cpp")] + "h"}
        self.assertEqual(faults, set())

    def test_rooms_form_no_cycle(self):
        order = []
        while len(order) < len(MAY_INCLUDE):
            ready = [r for r in MAY_INCLUDE if r not in order and MAY_INCLUDE[r] - {r} <= set(order)]
            self.assertTrue(ready, "rooms include each other in a circle: "
                            f"{sorted(set(MAY_INCLUDE) - set(order))}")
            order += ready

    def test_headers_form_no_cycle(self):
        state = {}

        def visit(name, trail):
            if state.get(name) == "done":
                return
            self.assertNotIn(name, trail, " > ".join(trail + [name]))
            for target in INCLUDES.get(name, []):
                if target in SOURCES:
                    visit(target, trail + [name])
            state[name] = "done"

        for name in INCLUDES:
            visit(name, [])

    def test_own_headers_are_included_from_the_root(self):
        faults = [f"{name}: {include}" for name, path in SOURCES.items() for include in INCLUDES[name]
                  if (path.parent / include).is_file() and not (ROOT / include).is_file()]
        self.assertEqual(faults, [])

    def test_json_is_read_in_one_place(self):
        # These limit the depth; a deeper document would overflow the stack of what compares or writes it.
        readers = {"data/base/json_text.cpp", "protocols/json_document.cpp"}
        parses = re.compile(r"(?i:json)::(parse|accept|sax_parse|from_\w+)\(")
        faults = [name for name, path in SOURCES.items() if name not in readers and parses.search(path.read_text())]
        self.assertEqual(faults, [])
        self.assertTrue(all(parses.search(SOURCES[name].read_text()) for name in readers))

    def test_rendering_is_pure(self):
        faults = [name for name, path in SOURCES.items()
                  if name.startswith("rendering/") and IMPURE.search(path.read_text())]
        self.assertEqual(faults, [])

    def test_top_level_holds_nothing_else(self):
        allowed = set(TOP) | {"tests", "CMakeLists.txt", "CMakePresets.json", "README.md", "LICENSE", "results"}
        found = {p.name for p in ROOT.iterdir() if not p.name.startswith(".")}
        self.assertEqual(found - allowed, set())


if __name__ == "__main__":
    sys.exit(unittest.main())
