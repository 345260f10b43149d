#pragma once
// Pango and fontconfig keep their fonts, for each thread, until the process ends, and a driver of
// OpenGL is unloaded with what it keeps; LeakSanitizer cannot see where. It asks this function
// whether it is wanted. For one source of a test program.

extern "C" int __lsan_is_turned_off() { return 1; }  // NOLINT(bugprone-reserved-identifier)
