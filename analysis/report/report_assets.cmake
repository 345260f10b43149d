# Style and script of a page.

# Text of a file as a C++ function that returns it.
function(palpate_text_function out name file)
  file(READ "${file}" text)
  file(APPEND "${out}" "std::string_view ${name}() {\n  return R\"palpate~(" "${text}"
       ")palpate~\";\n}\n\n")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}")
endfunction()

set(assets "${CMAKE_CURRENT_BINARY_DIR}/report_assets.cpp")
set(draft "${assets}.draft")
file(WRITE "${draft}" "// Made by report_assets.cmake when the build is configured.\n"
     "#include \"analysis/report/html_page.h\"\n\nnamespace palpate::analysis {\n\n")
palpate_text_function("${draft}" report_style "${CMAKE_CURRENT_SOURCE_DIR}/report/report.css")
palpate_text_function("${draft}" report_script "${CMAKE_CURRENT_SOURCE_DIR}/report/report.js")
file(APPEND "${draft}" "}  // namespace palpate::analysis\n")
configure_file("${draft}" "${assets}" COPYONLY)  # an equal one is left as it is
