# What the page of a trial carries beside its numbers: style and script.

set(assets "${CMAKE_CURRENT_BINARY_DIR}/watch_assets.cpp")
set(draft "${assets}.draft")
file(WRITE "${draft}" "// Made by watch_assets.cmake when the build is configured.\n"
     "#include \"runner/commands/watch/trial_page.h\"\n\nnamespace palpate::runner {\n\n")
# A literal may have 64 kB: more would need pieces.
foreach(asset css js)
  set(file "${CMAKE_CURRENT_SOURCE_DIR}/commands/watch/watch.${asset}")
  file(READ "${file}" text)
  file(APPEND "${draft}" "std::string_view watch_${asset}() {\n  return R\"palpate~(" "${text}" ")palpate~\";\n}\n\n")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}")
endforeach()
file(APPEND "${draft}" "}  // namespace palpate::runner\n")
configure_file("${draft}" "${assets}" COPYONLY)  # an equal one is left as it is
