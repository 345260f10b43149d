# Embedded parts of pages: style and script of the page of a trial, and the watchers' page of palpate serve. Both draw
# with drawing.js.

# palpate_embed(NAME HEADER FUNCTION TEXT...): functions that return these texts, in NAME.cpp of the build.
function(palpate_embed name header)
  set(assets "${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp")
  set(draft "${assets}.draft")
  file(WRITE "${draft}" "// Made by watch_assets.cmake when the build is configured.\n"
       "#include \"${header}\"\n\nnamespace palpate::runner::touch {\n\n")
  while(ARGN)
    list(POP_FRONT ARGN function text)
    # A literal may have 64 kB: more would need pieces.
    file(APPEND "${draft}" "std::string_view ${function}() {\n  return R\"palpate~(" "${${text}}" ")palpate~\";\n}\n\n")
  endwhile()
  file(APPEND "${draft}" "}  // namespace palpate::runner::touch\n")
  configure_file("${draft}" "${assets}" COPYONLY)  # an equal one is left as it is
endfunction()

foreach(file IN ITEMS watch/watch.css watch/drawing.js watch/trial.js watch/three_views.js
        watch/force_plot.js watch/watch.js serve/live.html serve/live.js)
  string(MAKE_C_IDENTIFIER "${file}" name)
  file(READ "${CMAKE_CURRENT_SOURCE_DIR}/commands/${file}" ${name})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/commands/${file}")
endforeach()
string(CONCAT watch_script "${watch_drawing_js}" "${watch_trial_js}" "${watch_three_views_js}" "${watch_force_plot_js}"
       "${watch_watch_js}")
palpate_embed(watch_assets runner/touch/trial_page.h watch_css watch_watch_css watch_js watch_script)
string(REPLACE "@SCRIPT@" "${watch_drawing_js}${serve_live_js}" live_text "${serve_live_html}")
palpate_embed(live_page runner/touch/trial_page.h live_page live_text)
