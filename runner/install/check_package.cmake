# Read by cpack.
if(CPACK_PALPATE_NATIVE)
  message(FATAL_ERROR "This build uses every instruction of this machine's processor: elsewhere the program may not "
                      "start. Make the package from the preset portable (PALPATE_NATIVE=OFF).")
endif()
