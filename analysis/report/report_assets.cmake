# What a report carries beside its figures: style, script, and Vega as Debian packages it
# (libjs-vega). Without Vega the program is built all the same, and reports show static figures.
set(PALPATE_VEGA_DIR "/usr/share/javascript/vega" CACHE PATH
    "Folder with Vega's modules as <name>.min.js; where there is none reports have static figures")

# In the order of their use of each other.
set(vega_modules util time format loader dataflow canvas scale scenegraph statistics expression
    event-selector selection functions runtime view parser interpreter encode view-transforms
    transforms)
set(vega_complete TRUE)
foreach(name IN LISTS vega_modules)
  if(NOT EXISTS "${PALPATE_VEGA_DIR}/vega-${name}.min.js")
    set(vega_complete FALSE)
  endif()
endforeach()
if(NOT vega_complete)
  message(STATUS "No Vega in ${PALPATE_VEGA_DIR}: reports will have static figures only")
  set(vega_modules "")
endif()

# Text of a file as a C++ function that returns it.
function(palpate_text_function out name file)
  file(READ "${file}" text)
  string(REGEX REPLACE "\n//# sourceMappingURL=[^\n]*" "" text "${text}")
  file(APPEND "${out}" "std::string_view ${name}() {\n  return R\"palpate~(" "${text}"
       ")palpate~\";\n}\n\n")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}")
endfunction()

set(assets "${CMAKE_CURRENT_BINARY_DIR}/report_assets.cpp")
set(draft "${assets}.draft")
file(WRITE "${draft}" "// Made by report_assets.cmake when the build is configured.\n"
     "#include \"analysis/report/report_assets.h\"\n\nnamespace palpate::analysis {\n\n")
palpate_text_function("${draft}" report_style "${CMAKE_CURRENT_SOURCE_DIR}/report/report.css")
palpate_text_function("${draft}" report_script "${CMAKE_CURRENT_SOURCE_DIR}/report/report.js")
palpate_text_function("${draft}" vega_notice "${CMAKE_CURRENT_SOURCE_DIR}/report/report_vega_notice.txt")
file(APPEND "${draft}" "namespace {\n\n")
set(entries "")
foreach(name IN LISTS vega_modules)
  string(REPLACE "-" "_" function "vega_${name}")
  palpate_text_function("${draft}" ${function} "${PALPATE_VEGA_DIR}/vega-${name}.min.js")
  string(APPEND entries "{\"vega-${name}\", ${function}()}, ")
endforeach()
file(APPEND "${draft}" "}  // namespace\n\n"
     "std::vector<ScriptModule> vega_modules() { return {${entries}}; }\n\n}  // namespace palpate::analysis\n")
configure_file("${draft}" "${assets}" COPYONLY)  # an equal one is left as it is
