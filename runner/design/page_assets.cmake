# Embedded parts of the page of palpate design: its own files, the schemas, and protocols to begin with.

# palpate_embed_table(OUT FUNCTION FILE...): appends a function that returns these files' names and texts to a text.
function(palpate_embed_table out function)
  set(rows "")
  foreach(file IN LISTS ARGN)
    file(READ "${file}" text)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}")
    get_filename_component(name "${file}" NAME)
    string(APPEND rows "      {\"${name}\", R\"palpate~(${text})palpate~\"},\n")
  endforeach()
  set(${out} "${${out}}std::span<const Asset> ${function}() {\n  static constexpr Asset kAssets[] = {\n${rows}  };\n  return kAssets;\n}\n\n"
      PARENT_SCOPE)
endfunction()

set(page "${CMAKE_CURRENT_SOURCE_DIR}/design/page")
set(protocols "${PROJECT_SOURCE_DIR}/protocols")
file(GLOB page_scripts CONFIGURE_DEPENDS "${page}/*.js")
set(template_files "")
foreach(name IN ITEMS stiffness-2afc ho2000 roughness-magnitude size-questplus stiffness-surface-size stiffness-two-groups
                      grating-roughness spacing-2afc tap-hardness visual-haptic-size force-field floating layered extended-probe quick)
  list(APPEND template_files "${protocols}/${name}.json")
endforeach()
set(design_assets "// Made by page_assets.cmake when the build is configured.\n#include \"runner/design/page_assets.h\"\n\nnamespace palpate::runner::design {\n\n")
palpate_embed_table(design_assets page_assets ${page}/design.html ${page}/design.css
  ${CMAKE_CURRENT_SOURCE_DIR}/commands/watch/drawing.js ${page_scripts}
  ${protocols}/protocol.schema.json ${protocols}/protocol.v2.schema.json ${protocols}/scene.schema.json)
palpate_embed_table(design_assets template_assets ${template_files})
string(APPEND design_assets "}  // namespace palpate::runner::design\n")
file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/design_assets.cpp.draft" "${design_assets}")
configure_file("${CMAKE_CURRENT_BINARY_DIR}/design_assets.cpp.draft" "${CMAKE_CURRENT_BINARY_DIR}/design_assets.cpp" COPYONLY)  # an equal one is left as it is
