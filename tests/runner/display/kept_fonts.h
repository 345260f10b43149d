#pragma once
// Pango and fontconfig keep their fonts, for each thread, until the process ends, and a driver of
// OpenGL is unloaded with its memory; LeakSanitizer reports both as leaks. It calls this function
// to learn whether it should be off. Include it in one source of a test program.

extern "C" int __lsan_is_turned_off() { return 1; }  // NOLINT(bugprone-reserved-identifier)
